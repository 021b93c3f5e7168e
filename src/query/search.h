#pragma once

namespace adaptive_bvh {

/// The walk over pairs of nodes of box trees that every query by boxes takes. A visitor decides:
///
///   Visitor::Pair          two nodes, with what is known of them
///   visitor.prune(pair)    is nothing below the two of interest? A visitor that remembers where it
///                          stopped does so here.
///   visitor.isLeafPair(pair)
///   visitor.testLeaves(pair)  two primitives
///   visitor.split(pair)    the pairs below, in the order in which they are to be visited
///   visitor.isDone()       is the answer found?
template <typename Visitor>
void searchPairs(Visitor& visitor, typename Visitor::Pair& pair) {
  if (visitor.prune(pair)) return;
  if (visitor.isLeafPair(pair)) return visitor.testLeaves(pair);
  auto below = visitor.split(pair);
  for (auto& next : below) {
    if (visitor.isDone()) return;
    searchPairs(visitor, next);
  }
}

}  // namespace adaptive_bvh
