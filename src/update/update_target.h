#pragma once

#include "geometry/mesh_of_model.h"
#include "tree/adaptive_tree.h"

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

}  // namespace adaptive_bvh
