#pragma once

#include <cstdint>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>

#include "fcl/cell_separation.h"

namespace adaptive_bvh {

/// A cell of an octree and where it is, in the octree's coordinates.
template <typename S>
struct Cell {
  Cell() = default;
  Cell(const typename fcl::OcTree<S>::OcTreeNode* cell, const fcl::AABB<S>& where)
      : node(cell), box(where), extent(where) {}

  const typename fcl::OcTree<S>::OcTreeNode* node;
  fcl::AABB<S> box;
  CellExtent<S> extent;
};

/// The occupied cells of an octree.
template <typename S>
class OctreeCells {
 public:
  explicit OctreeCells(const fcl::CollisionGeometry<S>& octree)
      : octree_(static_cast<const fcl::OcTree<S>&>(octree)) {}

  /// Calls start(cell) with the root, if it is occupied.
  template <typename Start>
  void visitRoot(Start&& start) const {
    if (const Node* root = octree_.getRoot(); root && octree_.isNodeOccupied(root))
      start(Cell<S>(root, octree_.getRootBV()));
  }
  bool isLeaf(const Cell<S>& cell) const { return !octree_.nodeHasChildren(cell.node); }

  /// Calls visit(cell) for the occupied children of a cell, until it returns true, and returns
  /// whether it did.
  template <typename Visit>
  bool forEachChild(const Cell<S>& cell, Visit&& visit) const {
    for (unsigned i = 0; i < 8; ++i) {
      if (!octree_.nodeChildExists(cell.node, i)) continue;
      const Node* child = octree_.getNodeChild(cell.node, i);
      if (!octree_.isNodeOccupied(child)) continue;
      fcl::AABB<S> box;
      fcl::computeChildBV(cell.box, i, box);
      if (visit(Cell<S>(child, box))) return true;
    }
    return false;
  }

  /// FCL's number of a cell.
  std::intptr_t id(const Cell<S>& cell) const { return cell.node - octree_.getRoot(); }

 private:
  using Node = typename fcl::OcTree<S>::OcTreeNode;

  const fcl::OcTree<S>& octree_;
};

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
