#pragma once

#include <memory>

#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// The exact distance of one pair of meshes, computed step after step. The results are those of
/// adaptive_bvh::distance. The search starts from the two triangles that were nearest last: their
/// distance is an upper bound of the new one. If nothing has moved, the last answer is returned.
///
///     adaptive_bvh::CoherentDistance pair(hose, engine);  // of DeformableMeshes
///     for (...) {
///       hose.update(positions);
///       fcl::DistanceResultd result;
///       pair.distance(hose_pose, engine_pose, fcl::DistanceRequestd(), result);
///     }
///
/// Any number of updates, large motions and other queries may come between two calls. They cost
/// time, but the result stays exact. One object serves one thread at a time; several may share a
/// mesh. A call that throws std::bad_alloc can be repeated.
class CoherentDistance {
 public:
  /// Keeps references: the meshes must outlive this object.
  CoherentDistance(const DeformableMesh& first, const DeformableMesh& second);
  ~CoherentDistance();
  /// The moved-from object can only be destroyed.
  CoherentDistance(CoherentDistance&&) noexcept;
  CoherentDistance(const CoherentDistance&) = delete;
  CoherentDistance& operator=(const CoherentDistance&) = delete;

  /// Returns the distance of the meshes placed by `tf1` and `tf2`. Request, result and errors are
  /// those of adaptive_bvh::distance. Allocates nothing in a steady state.
  double distance(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2,
                  const fcl::DistanceRequestd& request, fcl::DistanceResultd& result);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace adaptive_bvh
