#include "adaptive_bvh/coherent_distance.h"

#include "adaptive_bvh/query.h"
#include "model_state.h"
#include "query/boxed_distance.h"
#include "query/rigid_travel.h"

namespace adaptive_bvh {

template <typename BV>
struct CoherentDistance<BV>::State {
  State(const AdaptiveBVHModel<BV>& a, const AdaptiveBVHModel<BV>& b) : first(a), second(b) {}

  S distance(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
             const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);
  bool search(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
              const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);
  void walkFront(BoxedDistance<S>& search);

  const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) const {
    return detail::ModelAccess<BV>::tree(model);
  }

  const AdaptiveBVHModel<BV>&first, &second;
  RigidTravel<S> rigid;
  std::uint64_t generations[2] = {0, 0};
  std::vector<FrontPair> front, next;
  std::size_t fresh_size = 0;  ///< of the front that the last search from the roots left
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
  return adaptive_bvh::distance<S>(&first, tf1, &second, tf2, request, result);
}

/// False when boxes will not do, and nothing was done.
template <typename BV>
bool CoherentDistance<BV>::State::search(const fcl::Transform3<S>& tf1,
                                         const fcl::Transform3<S>& tf2,
                                         const fcl::DistanceRequest<S>& request,
                                         fcl::DistanceResult<S>& result) {
  if (request.isSatisfied(result)) return true;
  const std::uint64_t now[2] = {tree(first).generation, tree(second).generation};
  if (now[0] != generations[0] || now[1] != generations[1]) front.clear();
  generations[0] = now[0];
  generations[1] = now[1];
  rigid.moveTo(tf1, second, tf2);

  BoxedDistance<S> search({&first, &tree(first), tf1}, {&second, &tree(second), tf2}, request,
                          result, {&next, rigid.sum()});
  if (!search.isPossible()) return false;
  if (nearest1 < first.num_tris && nearest2 < second.num_tris) search.seed(nearest1, nearest2);
  next.clear();
  if (!search.isDone()) walkFront(search);
  search.finish();
  if (search.improved()) {
    nearest1 = result.b1;
    nearest2 = result.b2;
  }
  if (search.isDone()) next.clear();  // left half way
  front.swap(next);
  search.record();
  return true;
}

/// A front only grows finer. When it has become much larger than one that a search from the roots
/// leaves, that search is cheaper.
template <typename BV>
void CoherentDistance<BV>::State::walkFront(BoxedDistance<S>& search) {
  if (front.empty() || front.size() > 3 * fresh_size) {
    search.visit(0, 0);
    fresh_size = next.size();
    return;
  }
  for (const FrontPair& pair : front) {
    if (search.isSettled(pair))
      next.push_back(pair);
    else
      search.visit(pair.node1, pair.node2);
    if (search.isDone()) return;
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
