#pragma once

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "tree/adaptive_tree.h"
#include "update/frame_buffer.h"

namespace adaptive_bvh {

/// The thesis's update (4.3): takes the model to a new frame of complete, usable positions. Walks
/// the tree up once and down once: displacement, propagation, fitness and refit. Allocates nothing,
/// but for `prev_vertices` in the first FrameKind::Update, and on
/// more than one thread.
template <typename BV>
UpdateReport advance(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                     FrameKind kind, const fcl::Vector3<typename BV::S>* positions, int threads);

/// The same for a frame in which `count` vertices move, by `indices`; costs in proportion to what
/// is above them. Allocates once, when first called for a tree.
template <typename BV>
UpdateReport advance(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                     const unsigned* indices, const fcl::Vector3<typename BV::S>* positions,
                     std::size_t count);

/// Begins tracking at a tree whose volumes are our own fits of the present positions.
template <typename BV>
void adoptBuild(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree);

/// Repairs a tree that was changed, or built, behind our back: every volume is recomputed and
/// tracking begins anew. Nothing when the seal is intact. Threads that query may call it at once.
/// Returns whether the seal was broken.
template <typename BV>
bool repairIfChanged(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree);

}  // namespace adaptive_bvh
