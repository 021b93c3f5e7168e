#pragma once

#include "hierarchy/links.h"

namespace adaptive_bvh {

/// No group: the mate of an isolated one.
constexpr unsigned kNone = ~0u;

/// One level of the bottom-up build (thesis appendix): `mate[g]` is the group that g is paired
/// with, or kNone.
///
/// 1. The walk goes from a group to its best neighbour, from there to a better partner of that one,
///    if there is one, and so on. Two that prefer each other are paired, and the walk goes back to
///    the groups that it came by. The `favoured` groups go first and get their best neighbour at
///    once.
/// 2. Isolated groups, whose neighbours were all taken, search breadth-first through pairs for each
///    other. Along a path that is found every group changes its partner, so both ends get one.
///
/// A group that has a mate after 1. has one after 2. No recursion. The walk is linear but for the
/// sorting of neighbours; the search is linear a round, with at most 2 log2(n) + 8 rounds.
Scratch<unsigned> pairGroups(const GroupGraph& graph, const Scratch<unsigned>& favoured);

}  // namespace adaptive_bvh
