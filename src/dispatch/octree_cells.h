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

/// The occupied cells of an FCL octree of either number type, with boxes in double precision.
class OctreeCells {
  /// Returns function(octree), for either number type of the octree.
  template <typename Function>
  auto withOctree(const Function& function) const {
    return single_ ? function(*single_) : function(*double_);
  }

 public:
  explicit OctreeCells(const fcl::CollisionGeometryf& octree)
      : single_(static_cast<const fcl::OcTreef*>(&octree)) {}
  explicit OctreeCells(const fcl::CollisionGeometryd& octree)
      : double_(static_cast<const fcl::OcTreed*>(&octree)) {}

  fcl::AABBd rootBox() const {
    return withOctree([](const auto& octree) -> fcl::AABBd {
      const auto box = octree.getRootBV();
      return {box.min_.template cast<double>(), box.max_.template cast<double>()};
    });
  }
  /// Calls start(cell) with the root, if it is occupied.
  template <typename Start>
  void visitRoot(Start&& start) const {
    if (const Node* node = root(); node && isOccupied(node)) start(Cell(node, rootBox()));
  }
  bool isLeaf(const Cell& cell) const {
    return withOctree([&](const auto& octree) { return !octree.nodeHasChildren(cell.node); });
  }

  /// Calls visit(child) for the occupied children until it returns true; returns whether it did.
  template <typename Visit>
  bool forEachChild(const Cell& cell, Visit&& visit) const {
    for (unsigned i = 0; i < 8; ++i) {
      const Node* const child = occupiedChild(cell.node, i);
      if (!child) continue;
      fcl::AABBd box;
      fcl::computeChildBV(cell.box, i, box);
      if (visit(Cell(child, box))) return true;
    }
    return false;
  }

  /// FCL's number of a cell.
  std::intptr_t id(const Cell& cell) const { return cell.node - root(); }

 private:
  using Node = octomap::OcTreeNode;

  const Node* root() const {
    return withOctree([](const auto& octree) -> const Node* { return octree.getRoot(); });
  }
  bool isOccupied(const Node* node) const {
    return withOctree([&](const auto& octree) { return octree.isNodeOccupied(node); });
  }
  const Node* occupiedChild(const Node* node, unsigned i) const {
    return withOctree([&](const auto& octree) -> const Node* {
      if (!octree.nodeChildExists(node, i)) return nullptr;
      const Node* const child = octree.getNodeChild(node, i);
      return octree.isNodeOccupied(child) ? child : nullptr;
    });
  }

  const fcl::OcTreef* single_ = nullptr;
  const fcl::OcTreed* double_ = nullptr;
};

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
