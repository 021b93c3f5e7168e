#pragma once

#include <cstddef>

#include <fcl/common/types.h>

#include "mesh/mesh_view.h"
#include "volumes/adaptive_tree.h"

namespace adaptive_bvh {

/// The model of an update: FCL's part of it, and what stands beside.
template <typename BV>
struct UpdateTarget {
  fcl::BVHModel<BV>& model;
  AdaptiveTree<BV>& tree;

  int nodes() const { return model.getNumBVs(); }
  BV& volume(int node) const { return model.getBV(node).bv; }
};

/// The nodes in [first, last).
struct NodeRange {
  int first = 0, last = 0;
  bool contains(int node) const { return first <= node && node < last; }
};

/// How many volumes a propagation changed: see UpdateReport.
struct PropagationCounts {
  int moved = 0, inflated = 0;
  void operator+=(const PropagationCounts& other) {
    moved += other.moved;
    inflated += other.inflated;
  }
};

/// The two ways FCL brings in new positions: replace*, and update*, which keeps those of the step
/// before: volumes then hold both frames.
enum class StepKind { Replace, TwoFrames };

/// The new positions of a step.
template <typename S>
struct StepInput {
  StepKind kind = StepKind::Replace;
  const fcl::Vector3<S>* positions = nullptr;  ///< not in the model's own arrays
  std::size_t count = 0;
  const unsigned* indices = nullptr;  ///< whose positions they are; null: every vertex's, in order
};

}  // namespace adaptive_bvh
