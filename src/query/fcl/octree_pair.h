#pragma once

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/utility.h>

#include "query/fcl/cell_separation.h"
#include "query/placed_mesh.h"

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

/// What both queries need of a mesh and an octree.
template <typename BV>
class MeshOctreePair {
 public:
  using S = typename BV::S;
  using Node = typename fcl::OcTree<S>::OcTreeNode;

  MeshOctreePair(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& octree, S tolerance)
      : mesh_(*mesh.model),
        octree_(static_cast<const fcl::OcTree<S>&>(*octree.geometry)),
        octree_tf_(octree.tf),
        into_octree_(mesh.tf, octree.tf, tolerance),
        statistics_(statisticsOf(mesh)) {}
  ~MeshOctreePair() { statistics_.recordQuery(work_); }

  /// The octree's root, if there is an occupied one, is handed to start(cell).
  template <typename Start>
  void run(Start&& start) const {
    if (const Node* root = octree_.getRoot(); root && octree_.isNodeOccupied(root))
      start(Cell<S>(root, octree_.getRootBV()));
  }

  bool isLeaf(const Cell<S>& cell) const { return !octree_.nodeHasChildren(cell.node); }
  const fcl::BVNode<BV>& node(int b) const { return mesh_.getBV(b); }

  /// Whether of a cell and an inner node the cell is split. Chooses as FCL does.
  bool goesDownTheOctree(const Cell<S>& cell, int b) const {
    return !isLeaf(cell) && cell.box.size() > node(b).bv.size();
  }

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

  VolumeInOctree<BV> volume(int b) const { return {node(b).bv, into_octree_}; }

  /// The triangle of a leaf, as Bound.
  template <typename Bound>
  Bound triangle(int b) const {
    const fcl::Triangle& corners = mesh_.tri_indices[node(b).primitiveId()];
    return {mesh_.vertices[corners[0]], mesh_.vertices[corners[1]], mesh_.vertices[corners[2]],
            into_octree_};
  }

  void recordVisit(int b) const { statistics_.recordObstruction(b, 0); }
  void addTest() { ++work_.bv_tests; }

  /// Hands a cell to ask(cell's box, its pose).
  template <typename Ask>
  auto askSolver(const Cell<S>& cell, Ask&& ask) {
    ++work_.leaf_tests;
    fcl::Box<S> box;
    fcl::Transform3<S> box_tf;
    fcl::constructBox(cell.box, octree_tf_, box, box_tf);
    return ask(box, box_tf);
  }

  std::intptr_t id(const Cell<S>& cell) const { return cell.node - octree_.getRoot(); }

 private:
  const fcl::BVHModel<BV>& mesh_;
  const fcl::OcTree<S>& octree_;
  const fcl::Transform3<S> octree_tf_;
  const IntoOctree<S> into_octree_;
  const PairStatistics statistics_;
  QueryWork work_;
};

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
