#include "adaptive_bvh/coherent_distance.h"

#include "adaptive_bvh/query.h"
#include "geometry/rigid.h"
#include "model_state.h"
#include "query/pair_cache.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
struct CoherentDistance<BV>::State {
  const AdaptiveBVHModel<BV>&first, &second;
  PairCache<BV> cache;
};

template <typename BV>
CoherentDistance<BV>::CoherentDistance(const AdaptiveBVHModel<BV>& first,
                                       const AdaptiveBVHModel<BV>& second)
    : state_(std::make_unique<State>(State{first, second, {}})) {
  state_->cache.front.emplace();
}

template <typename BV>
CoherentDistance<BV>::~CoherentDistance() = default;
template <typename BV>
CoherentDistance<BV>::CoherentDistance(CoherentDistance&&) noexcept = default;

template <typename BV>
typename BV::S CoherentDistance<BV>::distance(const fcl::Transform3<S>& tf1,
                                              const fcl::Transform3<S>& tf2,
                                              const fcl::DistanceRequest<S>& request,
                                              fcl::DistanceResult<S>& result) {
  using Access = detail::ModelAccess<BV>;
  requireRigid(tf1);
  requireRigid(tf2);
  const AdaptiveBVHModel<BV>&first = state_->first, &second = state_->second;
  // Before anything reads the trees: this repairs one that was changed without our update.
  const bool has_triangles = Access::repairedType(first) != fcl::BV_UNKNOWN &&
                             Access::repairedType(second) != fcl::BV_UNKNOWN;
  const PlacedMesh<BV> a{&first, &Access::tree(first), tf1}, b{&second, &Access::tree(second), tf2};
  if (has_triangles && a.hasBoxes() && b.hasBoxes() &&
      distanceByBoxes<BV>(a, b, {request, result}, state_->cache))
    return result.min_distance;
  state_->cache.front->clear();
  // What adaptive_bvh::distance does: two adaptive models are always a recorded pair. Not called
  // itself, for it names fcl::distance, which libfcl does not hold for float: two minutes to
  // compile.
  S found = result.min_distance;
  detail::recordedDistance<S>(&first, tf1, &second, tf2, request, result, found);
  return found;
}

template <typename BV>
std::size_t CoherentDistance<BV>::frontSize() const {
  return state_->cache.front->size();
}

template <typename BV>
std::size_t CoherentDistance<BV>::bytes() const {
  return sizeof(State) + state_->cache.front->bytes();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class CoherentDistance<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
