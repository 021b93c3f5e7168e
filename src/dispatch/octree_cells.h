#pragma once

#include <cstdint>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>

#include "dispatch/cell_separation.h"

namespace adaptive_bvh {

/// A cell (node) of an octree, and its box in the octree's coordinates.
struct Cell {
  Cell() = default;
  Cell(const octomap::OcTreeNode* cell, const fcl::AABBd& cell_box)
      : node(cell), box(cell_box), extent(cell_box) {}

  fcl::Vector3d middle() const { return (box.min_ + box.max_) / 2; }
  fcl::Vector3d half() const { return (box.max_ - box.min_) / 2; }

  const octomap::OcTreeNode* node;
  fcl::AABBd box;
  CellExtent extent;
};

/// The occupied cells of an FCL octree.
class OctreeCells {
 public:
  explicit OctreeCells(const fcl::CollisionGeometryd& octree)
      : octree_(static_cast<const fcl::OcTreed&>(octree)) {}

  fcl::AABBd rootBox() const { return octree_.getRootBV(); }
  /// Calls start(cell) with the root, if it is occupied.
  template <typename Start>
  void visitRoot(Start&& start) const {
    const Node* const root = octree_.getRoot();
    if (root && octree_.isNodeOccupied(root)) start(Cell(root, rootBox()));
  }
  bool isLeaf(const Cell& cell) const { return !octree_.nodeHasChildren(cell.node); }

  /// Calls visit(child) for the occupied children until it returns true; returns whether it did.
  template <typename Visit>
  bool forEachChild(const Cell& cell, Visit&& visit) const {
    for (unsigned i = 0; i < 8; ++i) {
      if (!octree_.nodeChildExists(cell.node, i)) continue;
      const Node* const child = octree_.getNodeChild(cell.node, i);
      if (!octree_.isNodeOccupied(child)) continue;
      fcl::AABBd box;
      fcl::computeChildBV(cell.box, i, box);
      if (visit(Cell(child, box))) return true;
    }
    return false;
  }

  /// FCL's number of a cell.
  std::intptr_t id(const Cell& cell) const { return cell.node - octree_.getRoot(); }

 private:
  using Node = octomap::OcTreeNode;

  const fcl::OcTreed& octree_;
};

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
