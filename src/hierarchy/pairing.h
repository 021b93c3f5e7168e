#pragma once

#include "hierarchy/links.h"

namespace adaptive_bvh {

/// The mate of an unpaired group.
constexpr unsigned kNone = ~0u;

/// Pairs the groups of one level of the bottom-up build (thesis appendix). Element g of the result
/// is the partner ("mate") of group g, or kNone.
///
/// 1. Walk: from a group to its best neighbour, from there to a better partner of that neighbour if
///    there is one, and so on. Two groups that prefer each other are paired, and the walk returns
///    along its path. The `favoured` groups choose first and get their best neighbour at once.
/// 2. Search: unpaired groups, whose neighbours are all taken, search breadth-first for each other
///    through pairs. Along a path between two of them every group changes its partner, so both ends
///    get one.
///
/// A group that is paired in step 1 stays paired in step 2. No recursion. The walk takes linear
/// time, except for the sorting of neighbours; the search takes linear time per round, with at most
/// 2 log2(n) + 8 rounds.
Scratch<unsigned> pairGroups(const GroupGraph& graph, const Scratch<unsigned>& favoured);

}  // namespace adaptive_bvh
