#include "adaptive_bvh/coherent_distance.h"

#include <algorithm>

#include "adaptive_bvh/query.h"
#include "model_state.h"
#include "query/boxed_distance.h"
#include "query/rigid_motion.h"

namespace adaptive_bvh {

template <typename BV>
struct CoherentDistance<BV>::State {
  State(const AdaptiveBVHModel<BV>& a, const AdaptiveBVHModel<BV>& b) : first(a), second(b) {}

  S distance(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
             const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);
  bool search(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
              const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);
  void walk(BoxedDistance<S>& search);

  const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) const {
    return detail::ModelAccess<BV>::tree(model);
  }

  const AdaptiveBVHModel<BV>&first, &second;
  RigidMotion<S> rigid;
  std::uint64_t generations[2] = {0, 0};
  std::vector<FrontPair> front, next;
  /// Of a look at a pair of the front, in tests of boxes.
  static constexpr double kCheck = 0.4;
  static constexpr int kLongestPause = 15;
  double fresh_cost = 0;          ///< of the last search from the roots
  int pause = 0, pause_left = 0;  ///< searches from the roots that leave no front
  int nearest1 = 0, nearest2 = 0;
};

template <typename BV>
typename BV::S CoherentDistance<BV>::State::distance(const fcl::Transform3<S>& tf1,
                                                     const fcl::Transform3<S>& tf2,
                                                     const fcl::DistanceRequest<S>& request,
                                                     fcl::DistanceResult<S>& result) {
  // Asked first, for they repair a tree that was changed behind our back.
  const bool has_triangles =
      first.getNodeType() != fcl::BV_UNKNOWN && second.getNodeType() != fcl::BV_UNKNOWN;
  if (has_triangles && tree(first).boxes && tree(second).boxes && search(tf1, tf2, request, result))
    return result.min_distance;
  front.clear();
  // Two adaptive models always have a recorded query. adaptive_bvh::distance would name
  // fcl::distance too, which libfcl does not hold for float: two minutes of compilation.
  S found;
  detail::recordedDistance<S>(&first, tf1, &second, tf2, request, result, found);
  return found;
}

/// False when boxes will not do, and nothing was done.
template <typename BV>
bool CoherentDistance<BV>::State::search(const fcl::Transform3<S>& tf1,
                                         const fcl::Transform3<S>& tf2,
                                         const fcl::DistanceRequest<S>& request,
                                         fcl::DistanceResult<S>& result) {
  if (request.isSatisfied(result)) return true;
  const std::uint64_t now[2] = {tree(first).generation, tree(second).generation};
  const bool same_trees = now[0] == generations[0] && now[1] == generations[1];
  generations[0] = now[0];
  generations[1] = now[1];
  if (!rigid.moveTo(tf1, first, tf2, second) || !same_trees) front.clear();

  BoxedDistance<S> search({&first, &tree(first), tf1}, {&second, &tree(second), tf2}, request,
                          result, {pause_left > 0 ? nullptr : &next, rigid.sum()});
  if (!search.isPossible()) return false;
  search.seed(nearest1, nearest2);
  next.clear();
  if (!search.isDone()) walk(search);
  search.finish();
  if (search.improved()) {
    nearest1 = result.b1;
    nearest2 = result.b2;
  }
  if (search.isDone()) next.clear();  // left half way
  front.swap(next);
  return true;
}

/// A front only grows finer, and where motions are large against the distance most of its bounds
/// run out in a frame: then a search from the roots is cheaper. Both are weighed by what they cost
/// last. A front that did not pay is left off for 1 frame, then 2, 4, up to kLongestPause.
template <typename BV>
void CoherentDistance<BV>::State::walk(BoxedDistance<S>& search) {
  const bool from_roots = front.empty();
  if (from_roots) {
    search.visit(0, 0);
  } else {
    for (const FrontPair& pair : front) {
      if (search.isSettled(pair))
        next.push_back(pair);
      else
        search.visit(pair.node1, pair.node2);
      if (search.isDone()) break;
    }
  }
  const double cost = kCheck * double(front.size()) + search.cost();
  if (from_roots) {
    fresh_cost = cost;
    for (auto* pairs : {&front, &next}) pairs->reserve(2 * next.size());  // it will grow finer
    pause_left -= pause_left > 0;
  } else if (cost > fresh_cost) {
    next.clear();
    pause_left = pause = std::min(2 * pause + 1, kLongestPause);
  } else {
    pause = 0;
  }
}

template <typename BV>
CoherentDistance<BV>::CoherentDistance(const AdaptiveBVHModel<BV>& first,
                                       const AdaptiveBVHModel<BV>& second)
    : state_(std::make_unique<State>(first, second)) {}

template <typename BV>
CoherentDistance<BV>::~CoherentDistance() = default;
template <typename BV>
CoherentDistance<BV>::CoherentDistance(CoherentDistance&&) noexcept = default;

template <typename BV>
typename BV::S CoherentDistance<BV>::distance(const fcl::Transform3<S>& tf1,
                                              const fcl::Transform3<S>& tf2,
                                              const fcl::DistanceRequest<S>& request,
                                              fcl::DistanceResult<S>& result) {
  return state_->distance(tf1, tf2, request, result);
}

template <typename BV>
std::size_t CoherentDistance<BV>::frontSize() const {
  return state_->front.size();
}

template <typename BV>
std::size_t CoherentDistance<BV>::bytes() const {
  return sizeof(State) + (state_->front.capacity() + state_->next.capacity()) * sizeof(FrontPair);
}

template class CoherentDistance<fcl::RSS<float>>;
template class CoherentDistance<fcl::RSS<double>>;

}  // namespace adaptive_bvh
