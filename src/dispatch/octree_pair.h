#pragma once

#include "dispatch/octree_cells.h"
#if FCL_HAVE_OCTOMAP

#include "base/rigid.h"
#include "dispatch/octree_nodes.h"
#include "dispatch/shape_triangles.h"
#include "query/placed_mesh.h"
#include "solids/box.h"

namespace adaptive_bvh {

/// An octree, and its pose.
struct PlacedOctree {
  OctreeCells cells;
  fcl::Transform3d tf;
};

/// A mesh and an octree: bounds and tests of nodes and cells, in the octree's coordinates. The
/// destructor reports the numbers of tests.
class MeshOctreePair {
 public:
  MeshOctreePair(const QueryTriangles& mesh, const MeshNodes& nodes, const PlacedOctree& octree)
      : triangles_(mesh),
        nodes_(nodes),
        octree_(octree),
        to_octree_(octree.tf, mesh.tf),
        into_octree_(mesh.tf, octree.tf) {}
  MeshOctreePair(const MeshOctreePair&) = delete;
  MeshOctreePair& operator=(const MeshOctreePair&) = delete;
  ~MeshOctreePair() { nodes_.recordTests(node_tests_, leaf_tests_); }

  const OctreeCells& octree() const { return octree_.cells; }
  const MeshNodes& nodes() const { return nodes_; }

  /// Whether a search descends in the octree instead of the mesh's tree: FCL's rule.
  bool descendsInOctree(const Cell& cell, MeshNode node) const {
    return !octree().isLeaf(cell) && cell.box.size() > nodes_.size(node);
  }

  VolumeInOctree volume(MeshNode node) const { return {nodes_.body(node), into_octree_}; }

  /// The triangle of a leaf, as a TriangleOverlap or a TriangleDistance.
  template <typename Bound>
  Bound triangle(MeshNode leaf) const {
    const TrianglePoints x = triangles_[nodes_.triangle(leaf)];
    return {x[0], x[1], x[2], into_octree_};
  }

  void addTest() { ++node_tests_; }  ///< counts a test of a node and a cell

  /// A cell and a triangle, in the octree's axes, relative to the centre of the cell.
  class CellAndTriangle {
   public:
    TriangleGap gap() const { return box_.gap(corners_); }
    bool touches(ShapeContact& contact) const { return box_.touches(corners_, contact); }
    fcl::Vector3d inWorld(const fcl::Vector3d& x) const { return octree_tf_ * (middle_ + x); }
    fcl::Vector3d turnedToWorld(const fcl::Vector3d& direction) const {
      return octree_tf_.linear() * direction;
    }

   private:
    friend class MeshOctreePair;
    CellAndTriangle(const Cell& cell, const TrianglePoints& corners,
                    const fcl::Transform3d& octree_tf)
        : middle_(cell.middle()), box_(cell.half()), corners_(corners), octree_tf_(octree_tf) {
      for (fcl::Vector3d& x : corners_) x -= middle_;
    }

    const fcl::Vector3d middle_;
    const BoxSolid box_;
    TrianglePoints corners_;
    const fcl::Transform3d& octree_tf_;
  };
  CellAndTriangle cellAndTriangle(const Cell& cell, int triangle) {
    ++leaf_tests_;
    const TrianglePoints x = triangles_[triangle];
    return CellAndTriangle(cell, {to_octree_(x[0]), to_octree_(x[1]), to_octree_(x[2])},
                           octree_.tf);
  }

 private:
  const QueryTriangles triangles_;
  const MeshNodes& nodes_;
  const PlacedOctree octree_;
  const RelativePlacement to_octree_;
  const IntoOctree into_octree_;
  std::size_t node_tests_ = 0, leaf_tests_ = 0;
};

/// Lowers query.result to the distance of an octree (first object) and triangles. Sets no objects.
void distanceToOctree(const QueryTriangles& mesh, const MeshNodes& nodes,
                      const PlacedOctree& octree, const DistanceQuery& query);

/// Adds the contacts of triangles with an octree, which is the first object.
void collideWithOctree(const QueryTriangles& mesh, const MeshNodes& nodes,
                       const PlacedOctree& octree, const fcl::CollisionGeometryd& o1,
                       const fcl::CollisionGeometryd& o2, const CollisionQuery& query);

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
