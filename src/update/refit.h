#pragma once

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "tree/adaptive_tree.h"

namespace adaptive_bvh {

/// Recomputes the volumes that `policy` calls unfit from their triangles, thesis 4.3 and 4.5.
/// A node is judged and refitted by itself: its children keep what they have. Afterwards its
/// current radius is its original radius. Without evidence (no recording query since the last
/// update) tests B and D count as true for every node and test C as false.
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

/// The same for the marked nodes and the root alone; unmarks them. Replaces those that have
/// decayed.
template <typename BV>
void refitUnfitMarked(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                      UpdateReport& report);

/// Bounds how far a volume can decay that no query has met for long: one that has grown by more
/// than the radius of its box is replaced by the volume around that box, which is looser than a
/// fit, but costs next to nothing. Looks at a sixteenth of the nodes, at others in the next update;
/// so a volume that FCL's own queries come upon is never looser than its box by more than the box's
/// radius and sixteen frames' growth. Only with Propagation::Boxes, and not where the policy never
/// refits. Deterministic; to be called once an update, by one thread.
template <typename BV>
void replaceDecayed(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy);

/// Recomputes every volume but the root's in place. Returns the root's, for Seal::close to write
/// last: queries on other threads may be looking at it meanwhile.
template <typename BV>
BV refitAllButRoot(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree);

}  // namespace adaptive_bvh
