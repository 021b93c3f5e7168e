#pragma once

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "tree/adaptive_tree.h"

namespace adaptive_bvh {

/// Recomputes the volumes that `policy` calls unfit from their triangles, thesis 4.3 and 4.5.
/// A node is judged and refitted by itself: its children keep what they have. Afterwards its
/// current radius is its original radius. Without evidence (no recording query since the last
/// update) test B counts as true for every node and test C as false.
///
/// Adds what it did to `report`. Allocates nothing.
template <typename BV>
void refitUnfit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                UpdateReport& report);

/// The same for the nodes in [begin, end). Touches nothing else, so that several threads can share
/// the work; returns the largest `reach` of what it refitted, for AdaptiveTree::widenReach.
template <typename BV>
typename BV::S refitUnfit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree,
                          const RefitPolicy& policy, int begin, int end, UpdateReport& report);

/// The same for the marked nodes and the root alone; unmarks them, and forgets what was seen of
/// them.
template <typename BV>
void refitUnfitMarked(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                      UpdateReport& report);

/// Recomputes every volume but the root's in place. Returns the root's, for Seal::close to write
/// last: queries on other threads may be looking at it meanwhile.
template <typename BV>
BV refitAllButRoot(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree);

}  // namespace adaptive_bvh
