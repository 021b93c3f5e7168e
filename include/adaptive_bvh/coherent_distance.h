#pragma once

#include <memory>

#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// The exact distance of one pair of meshes, asked step after step. Answers as
/// adaptive_bvh::distance does, and starts from the two triangles that were nearest last: their
/// distance bounds the new one from above. Where nothing has moved it has the answer already.
///
///     adaptive_bvh::CoherentDistance pair(hose, engine);  // of DeformableMeshes
///     for (...) {
///       hose.update(positions);
///       fcl::DistanceResultd result;
///       pair.distance(hose_pose, engine_pose, fcl::DistanceRequestd(), result);
///     }
///
/// Any number of updates, also none, may come between two calls; so may large motions and other
/// queries. They cost time, never exactness. One object serves one thread at a time; several may
/// share a mesh.
template <typename S>
class CoherentDistance {
 public:
  /// Keeps references: the meshes must outlive this object.
  CoherentDistance(const DeformableMesh<S>& first, const DeformableMesh<S>& second);
  ~CoherentDistance();
  /// The moved-from object can only be destroyed.
  CoherentDistance(CoherentDistance&&) noexcept;
  CoherentDistance(const CoherentDistance&) = delete;
  CoherentDistance& operator=(const CoherentDistance&) = delete;

  /// The distance of the meshes placed by `tf1` and `tf2`. Result, request and errors as for
  /// adaptive_bvh::distance. In a steady state it allocates nothing.
  S distance(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
             const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

using CoherentDistancef = CoherentDistance<float>;   ///< in single precision
using CoherentDistanced = CoherentDistance<double>;  ///< in double precision

/// The meshes say which numbers.
template <typename S>
CoherentDistance(const DeformableMesh<S>&, const DeformableMesh<S>&) -> CoherentDistance<S>;

extern template class CoherentDistance<float>;
extern template class CoherentDistance<double>;

}  // namespace adaptive_bvh
