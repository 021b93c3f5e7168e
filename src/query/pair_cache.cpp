#include "query/pair_cache.h"

#include <algorithm>

namespace adaptive_bvh {

template <typename BV>
void Front<BV>::moveTo(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  const std::uint64_t now[2] = {first.tree->generation, second.tree->generation};
  const bool same_trees = std::equal(now, now + 2, generations_);
  std::copy(now, now + 2, generations_);
  if (!rigid_.moveTo(first.tf, *first.model, second.tf, *second.model) || !same_trees) clear();
  next_.clear();
}

template <typename BV>
void Front<BV>::search(DistanceVisitor<BV>& visitor) {
  const bool from_roots = pairs_.empty();
  if (from_roots) {
    visitor.search(0, 0);
  } else {
    for (const FrontPair& pair : pairs_) {
      if (visitor.isStillPruned(pair))
        next_.push_back(pair);
      else
        visitor.search(pair.node1, pair.node2);
      if (visitor.isDone()) break;
    }
  }
  const double cost = kCheck * double(pairs_.size()) + visitor.cost();
  if (from_roots) {
    cost_from_roots_ = cost;
    for (auto* pairs : {&pairs_, &next_}) pairs->reserve(2 * next_.size());  // it will grow finer
    pause_left_ -= pause_left_ > 0;
  } else if (cost > cost_from_roots_) {
    next_.clear();
    pause_left_ = pause_ = std::min(2 * pause_ + 1, kLongestPause);
  } else {
    pause_ = 0;
  }
}

template <typename BV>
void Front<BV>::finish(const DistanceVisitor<BV>& visitor) {
  if (visitor.isDone()) next_.clear();  // not complete
  pairs_.swap(next_);
}

template <typename BV>
bool distanceByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                     const DistanceQuery<typename BV::S>& query, PairCache<BV>& cache) {
  if (query.isSatisfied()) return true;
  const bool with_front = cache.front.has_value();
  if (with_front) cache.front->moveTo(first, second);
  DistanceVisitor<BV> visitor(first, second, query, with_front ? cache.front->sink() : FrontSink());
  if (!visitor.isPossible()) return false;
  visitor.addWitness(cache.witness1, cache.witness2);
  if (!visitor.isDone()) {
    if (with_front)
      cache.front->search(visitor);
    else
      visitor.search(0, 0);
  }
  if (visitor.finish()) {
    cache.witness1 = static_cast<int>(query.result.b1);
    cache.witness2 = static_cast<int>(query.result.b2);
  }
  if (with_front) cache.front->finish(visitor);
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                          \
  template class Front<BV>;                                                   \
  template bool distanceByBoxes(const PlacedMesh<BV>&, const PlacedMesh<BV>&, \
                                const DistanceQuery<BV::S>&, PairCache<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
