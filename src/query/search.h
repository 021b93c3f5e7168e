#pragma once

namespace adaptive_bvh {

/// The depth-first search over pairs of nodes of box trees, for distances. (Contacts: WideSearch.)
/// A visitor decides:
///
///   Visitor::Pair             two nodes, with what is known of them
///   visitor.prune(pair)       true: nothing below the two matters. A visitor that remembers where
///                             it stopped does so here.
///   visitor.isLeafPair(pair)  whether both are leaves
///   visitor.testLeaves(pair)  works on the two primitives of leaves
///   visitor.split(pair)       the pairs below, in the order in which they are to be visited
///   visitor.isDone()          whether the answer is found
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
