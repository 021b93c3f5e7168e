#include "query/pair_cache.h"

#include <algorithm>
#include <cmath>

namespace adaptive_bvh {

template <typename BV>
void Front<BV>::moveTo(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  const std::uint64_t now[2] = {first.tree->generation, second.tree->generation};
  const bool same_trees = std::equal(now, now + 2, generations_);
  std::copy(now, now + 2, generations_);
  if (!rigid_.moveTo(first.tf, *first.model, second.tf, *second.model) || !same_trees) clear();
}

/// Of a search from the pairs, judged by some of them. The bounds of a sample are new and all still
/// have something to spare, so it tells the mean cost of many steps like this one: each bound ends
/// when these have used it up.
template <typename BV>
double Front<BV>::expectedCost(const PairSearch<BV>& search) const {
  if (pairs_.empty()) return std::numeric_limits<double>::max();
  const std::size_t step = isWhole() ? std::max<std::size_t>(1, pairs_.size() / kChecked) : 1;
  double checked = 0, ended = 0;
  for (std::size_t i = 0; i < pairs_.size(); i += step) {
    ++checked;
    ended += isWhole() ? !search.stops().isStillPruned(pairs_[i]) : search.stops().used(pairs_[i]);
  }
  return double(pairs_.size() * every_) * (kCheck + searchBelow() * ended / checked);
}

template <typename BV>
void Front<BV>::run(PairSearch<BV>& search, bool& are_near) {
  const double expected = expectedCost(search);
  if (isWhole()) {
    const double renewal = cost_from_roots_ + cost_of_stops_;
    const bool worn = account_.excess > renewal || account_.spent > kRenewal * renewal;
    if (!worn && expected < cost_from_roots_) return searchFromPairs(search, are_near);
    needed_promises_ = account_.saved > 0 ? 1 : std::min(2 * needed_promises_, kMostPromises);
    promises_ = 0;
  }
  const double written = cost_of_stops_ * double(every_) / kLasts;
  promises_ = expected + written < kPays * cost_from_roots_ ? promises_ + 1 : 0;
  searchFromRoots(search, are_near, promises_ >= needed_promises_ ? 1 : samplingStride(stops_));
}

template <typename BV>
void Front<BV>::searchFromRoots(PairSearch<BV>& search, bool& are_near, std::size_t every) {
  clear();
  if (every == 1) pairs_.reserve(stops_ * 5 / 4);
  search.stops().keep(pairs_, every);
  search.fromRoots(are_near);
  if (search.isDone()) {
    clear();  // not complete
  } else {
    stops_ = pairs_.size() * every;
    every_ = every;
  }
  cost_from_roots_ = search.cost();
  cost_of_stops_ = search.stops().cost();
  search_below_ += (1 - search_below_) / 16;
  account_ = {};
  account_.saved = -cost_of_stops_;
}

/// A pair that no longer prunes gives its place to one of those that replace it.
template <typename BV>
void Front<BV>::searchFromPairs(PairSearch<BV>& search, bool are_near) {
  if (are_near) search.useWideTrees();
  every_ = kSparse;  // not whole until the end
  added_.clear();
  search.stops().keep(added_, 1);
  double ended = 0;
  for (FrontPair& pair : pairs_) {
    if (search.stops().isStillPruned(pair)) continue;
    ++ended;
    search.below(pair.node1, pair.node2);
    if (search.isDone()) return clear();  // not complete
    pair = added_.back();
    added_.pop_back();
  }
  const double below = search.cost() + search.stops().cost();
  const double cost = kCheck * double(pairs_.size()) + below;
  pairs_.insert(pairs_.end(), added_.begin(), added_.end());
  every_ = 1;
  if (ended > 0) search_below_ *= (1 + below / ended / searchBelow()) / 2;
  account_.add(cost, cost_from_roots_);
}

namespace {

/// How far the transforms have moved the models since its front was begun.
template <typename BV>
double moveTo(PairCache<BV>& cache, const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  if (!cache.front) return 0;
  cache.front->moveTo(first, second);
  return cache.front->rigidMotion();
}

/// False when the objects lie too far apart, and nothing was done; or when it is to be `brief`, and
/// would take many tests. From the front, where there is one and the witness is not enough.
template <typename BV>
bool search(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second, NearestPair<BV>& nearest,
            const fcl::DistanceResult<typename BV::S>& result, PairCache<BV>& cache, bool brief) {
  PairSearch<BV> search(first, second, nearest, moveTo(cache, first, second));
  if (!search.isPossible()) return false;
  nearest.addWitness(cache.witness1, cache.witness2);
  const bool is_given_up = !nearest.isDone() && brief && !search.briefly();
  if (brief)
    cache.are_near = is_given_up;
  else if (!nearest.isDone() && cache.front)
    cache.front->run(search, cache.are_near);
  else if (!nearest.isDone())
    search.fromRoots(cache.are_near);
  else if (cache.front)
    cache.front->clear();
  search.record();
  if (nearest.finish()) {
    cache.witness1 = static_cast<int>(result.b1);
    cache.witness2 = static_cast<int>(result.b2);
  }
  return !is_given_up;
}

}  // namespace

template <typename BV>
bool distanceByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                     const DistanceQuery<typename BV::S>& query, PairCache<BV>& cache) {
  if (query.isSatisfied()) return true;
  updateBoxes(first);
  updateBoxes(second);
  NearestPair<BV> nearest(first, second, query);
  return search(first, second, nearest, query.result, cache, false);
}

template <typename BV>
std::optional<bool> compareByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                   typename BV::S enough, bool brief, PairCache<BV>& cache,
                                   typename BV::S& farther) {
  using S = typename BV::S;
  if (brief && cache.are_near) return std::nullopt;
  updateBoxes(first);
  updateBoxes(second);
  const fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result(
      std::max(farther, std::nextafter(enough, std::numeric_limits<S>::max())));
  NearestPair<BV> nearest(first, second, {request, result});
  nearest.stopAt(enough);
  if (!search(first, second, nearest, result, cache, brief)) return std::nullopt;
  farther = result.min_distance;
  return result.min_distance <= enough;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                               \
  template class Front<BV>;                                                                        \
  template bool distanceByBoxes(const PlacedMesh<BV>&, const PlacedMesh<BV>&,                      \
                                const DistanceQuery<BV::S>&, PairCache<BV>&);                      \
  template std::optional<bool> compareByBoxes(const PlacedMesh<BV>&, const PlacedMesh<BV>&, BV::S, \
                                              bool, PairCache<BV>&, BV::S&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
