#pragma once

#include <memory>

#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/adaptive_bvh_model.h"

namespace adaptive_bvh {

/// The exact distance of one pair of models, asked step after step. Answers as
/// adaptive_bvh::distance does, and remembers where its search stopped: pairs of nodes, each with a
/// bound of their distance. The next search starts there. It does not visit pairs again that
/// deformation and changed transforms cannot have brought nearer than the nearest triangles
/// (generalized front tracking; Ehmann and Lin 2001, "Accurate and fast proximity queries between
/// polyhedra using convex surface decomposition").
///
///     adaptive_bvh::CoherentDistance pair(hose, engine);  // of AdaptiveBVHModels with one volume
///     for (...) {
///       hose.update(positions);
///       fcl::DistanceResultd result;
///       pair.distance(hose_pose, engine_pose, fcl::DistanceRequestd(), result);
///     }
///
/// It remembers only what promises to save more than it costs: where steps are large against the
/// distance, its search is that of adaptive_bvh::distance.
///
/// Any number of updates, also none, may come between two calls; so may large motions, builds and
/// other queries. They cost time, never exactness.
///
/// Works best on models with Propagation::TranslationCompensated, the default; with others it hands
/// over to adaptive_bvh::distance. One object serves one thread at a time; several may share a
/// model.
template <typename BV>
class CoherentDistance {
 public:
  using S = typename BV::S;  ///< float or double

  /// Keeps references: the models must outlive this object.
  CoherentDistance(const AdaptiveBVHModel<BV>& first, const AdaptiveBVHModel<BV>& second);
  ~CoherentDistance();
  /// The moved-from object can only be destroyed.
  CoherentDistance(CoherentDistance&&) noexcept;
  CoherentDistance(const CoherentDistance&) = delete;
  CoherentDistance& operator=(const CoherentDistance&) = delete;

  /// The distance of the models placed by `tf1` and `tf2`. Result, request and errors as for
  /// adaptive_bvh::distance. In a steady state it allocates nothing.
  S distance(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
             const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);

  /// How many pairs of nodes are remembered; 0 when the next search starts at the roots.
  std::size_t frontSize() const;
  /// Memory of this object, in bytes.
  std::size_t bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

using CoherentDistancef = CoherentDistance<fcl::RSS<float>>;
using CoherentDistanced = CoherentDistance<fcl::RSS<double>>;
using CoherentOBBRSSDistancef = CoherentDistance<fcl::OBBRSS<float>>;
using CoherentOBBRSSDistanced = CoherentDistance<fcl::OBBRSS<double>>;

/// The models say which volume.
template <typename BV>
CoherentDistance(const AdaptiveBVHModel<BV>&, const AdaptiveBVHModel<BV>&) -> CoherentDistance<BV>;

extern template class CoherentDistance<fcl::RSS<float>>;
extern template class CoherentDistance<fcl::RSS<double>>;
extern template class CoherentDistance<fcl::OBBRSS<float>>;
extern template class CoherentDistance<fcl::OBBRSS<double>>;

}  // namespace adaptive_bvh
