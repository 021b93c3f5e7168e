#pragma once

#include "hierarchy/group_graph.h"

namespace adaptive_bvh {

/// Nobody: the mate of an isolated group.
constexpr unsigned kNone = ~0u;

/// One level of the bottom-up build (thesis appendix): `mate[g]` is the group that g is paired
/// with, or kNone.
///
/// 1. The walk. From a group to its best neighbour, from that on to a better partner of its own, if
///    it has one, and so on; the two who prefer each other are paired, and the walk goes back to
///    those it came by. The `favoured` groups go first and get their best neighbour outright.
/// 2. Isolated groups, all of whose neighbours were taken, search breadth-first through pairs for
///    each other; along a path found, every group changes its partner, and both ends have one.
///
/// A group that has a mate after 1. has one after 2. No recursion. The walk is linear but for the
/// sorting of neighbours; the search is linear a round, with at most 2 log2(n) + 8 rounds.
Scratch<unsigned> pairGroups(const GroupGraph& graph, const Scratch<unsigned>& favoured);

}  // namespace adaptive_bvh
