#pragma once

#include "fcl/octree_cells.h"
#if FCL_HAVE_OCTOMAP

#include "base/rigid.h"
#include "fcl/mesh_pairs.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_shape.h"

namespace adaptive_bvh {

/// The nodes of FCL's tree of a mesh.
template <typename BV>
class FclNodes {
 public:
  using S = typename BV::S;
  using P = S;  ///< of positions
  using Node = int;

  explicit FclNodes(const PlacedModel<BV>& model)
      : mesh_(*model.model), statistics_(statisticsOf(model)) {}

  static Node root() { return 0; }
  bool isLeaf(Node node) const { return mesh_.getBV(node).isLeaf(); }
  int triangle(Node leaf) const { return mesh_.getBV(leaf).primitiveId(); }
  SweptBox<S> body(Node node) const { return sweptBoxOf(mesh_.getBV(node).bv); }
  /// As FCL compares it with that of a cell.
  S size(Node node) const { return mesh_.getBV(node).bv.size(); }

  /// Calls visit(node) for those below, until it returns true, and returns whether it did.
  template <typename Visit>
  bool forEachBelow(Node node, const Visit& visit) const {
    return visit(mesh_.getBV(node).leftChild()) || visit(mesh_.getBV(node).rightChild());
  }
  void recordVisit(Node node) const { statistics_.recordObstruction(node, 0); }
  void recordQuery(const QueryWork& work) const { statistics_.recordQuery(work); }
  static void addTest(QueryWork& work) { ++work.bv_tests; }

 private:
  const fcl::BVHModel<BV>& mesh_;
  const PairStatistics statistics_;
};

/// The boxes of a mesh's four-wide tree.
template <typename Scalar>
class WideNodes {
 public:
  using S = Scalar;
  using P = double;  ///< of positions
  /// A box of a node; lane -1: all of them.
  struct Node {
    int wide, lane;
  };

  explicit WideNodes(const MeshObject<S>& mesh)
      : tree_(mesh.placed.tree()), axes_(tree_.coordinates().axes().template cast<S>()) {}

  static Node root() { return {0, -1}; }
  bool isLeaf(Node node) const { return node.lane >= 0 && wide(node).isLeaf(); }
  int triangle(Node leaf) const {
    return tree_.triangle(static_cast<unsigned>(wide(leaf).first + leaf.lane));
  }
  SweptBox<S> body(Node node) const {
    const Box box = boxOf(node);
    const Float4 center = box.center(), half = box.halfSides();
    const S unit = static_cast<S>(1 / tree_.scale());
    SweptBox<S> body;
    body.axes = axes_;
    body.radius = 0;
    body.middle = tree_.origin().template cast<S>();
    for (int k = 0; k < 3; ++k) {
      body.middle += axes_.col(k) * (unit * S(center[k]));
      body.half[k] = axes_.col(k) * (unit * S(half[k]));
    }
    // Coordinates in the tree are below 2; three times those, for they were rounded here.
    body.coordinate_sum = tree_.origin().template cast<S>().template lpNorm<1>() + 18 * unit;
    return body;
  }
  S size(Node node) const {
    const Box box = boxOf(node);
    return static_cast<S>(double(float4::sum(box.high - box.low)) / tree_.scale());
  }

  template <typename Visit>
  bool forEachBelow(Node node, const Visit& visit) const {
    const int below = node.lane < 0 ? node.wide : wide(node).below[node.lane];
    for (int i = 0; i < int(tree_.nodes()[below].count); ++i)
      if (visit(Node{below, i})) return true;
    return false;
  }
  static void recordVisit(Node) {}
  static void recordQuery(const QueryWork&) {}
  static void addTest(QueryWork& work) { ++work.box_tests; }

 private:
  const WideNode& wide(Node node) const { return tree_.nodes()[node.wide]; }
  Box boxOf(Node node) const {
    if (node.lane >= 0) return wide(node).boxes.box(node.lane);
    Box all = wide(node).boxes.box(0);
    for (int i = 1; i < int(wide(node).count); ++i) all.add(wide(node).boxes.box(i));
    return all;
  }

  const WideTree& tree_;
  const fcl::Matrix3<S> axes_;
};

template <typename BV>
PlacedTriangles<typename BV::S> trianglesOf(const PlacedModel<BV>& model) {
  return model.triangles();
}
template <typename S>
PlacedTriangles<S, double> trianglesOf(const MeshObject<S>& mesh) {
  return {mesh.geometry, mesh.placed.mesh.view(), mesh.tf};
}

/// What both queries need of a mesh and an octree. `Nodes`: FclNodes or WideNodes of the mesh.
template <typename Nodes>
class MeshOctreePair {
 public:
  using S = typename Nodes::S;
  using MeshNode = typename Nodes::Node;

  /// `mesh`: what Nodes are made of.
  template <typename Placed>
  MeshOctreePair(const Placed& mesh, const PlacedGeometry<S>& octree)
      : triangles_(trianglesOf(mesh).view),
        nodes_(mesh),
        octree_(*octree.geometry),
        octree_tf_(octree.tf.template cast<double>()),
        to_octree_(octree.tf, mesh.tf),
        into_octree_(mesh.tf, octree.tf) {}
  MeshOctreePair(const MeshOctreePair&) = delete;
  MeshOctreePair& operator=(const MeshOctreePair&) = delete;
  ~MeshOctreePair() { nodes_.recordQuery(work_); }

  /// The octree's root, if there is an occupied one, is handed to start(cell).
  template <typename Start>
  void run(Start&& start) const {
    octree_.visitRoot(start);
  }

  const Nodes& nodes() const { return nodes_; }
  bool isLeaf(const Cell<S>& cell) const { return octree_.isLeaf(cell); }

  /// Whether of a cell and an inner node the cell is split. Chooses as FCL does.
  bool goesDownTheOctree(const Cell<S>& cell, MeshNode node) const {
    return !isLeaf(cell) && cell.box.size() > nodes_.size(node);
  }

  template <typename Visit>
  bool forEachChild(const Cell<S>& cell, Visit&& visit) const {
    return octree_.forEachChild(cell, visit);
  }

  VolumeInOctree<S> volume(MeshNode node) const { return {nodes_.body(node), into_octree_}; }

  /// The triangle of a leaf, as Bound.
  template <typename Bound>
  Bound triangle(MeshNode leaf) const {
    const VertexIndices v = triangles_.verticesOf(static_cast<unsigned>(nodes_.triangle(leaf)));
    const auto point = [&](std::size_t k) -> fcl::Vector3<S> {
      return triangles_.vertices[v[k]].template cast<S>();
    };
    return {point(0), point(1), point(2), into_octree_};
  }

  void addTest() { Nodes::addTest(work_); }

  /// A cell and a triangle, seen from the middle of the cell.
  class LeafPair {
   public:
    TriangleGap gap() const { return box_.gap(corners_); }
    bool touches(ShapeContact& contact) const { return box_.touches(corners_, contact); }
    fcl::Vector3<S> inWorld(const fcl::Vector3d& x) const {
      return (octree_tf_ * (middle_ + x)).template cast<S>();
    }
    fcl::Vector3<S> turnedToWorld(const fcl::Vector3d& direction) const {
      return (octree_tf_.linear() * direction).template cast<S>();
    }

   private:
    friend class MeshOctreePair;
    LeafPair(const fcl::AABB<S>& cell, const TrianglePoints<double>& corners,
             const fcl::Transform3d& octree_tf)
        : middle_((cell.min_.template cast<double>() + cell.max_.template cast<double>()) / 2),
          box_((cell.max_.template cast<double>() - cell.min_.template cast<double>()) / 2),
          corners_(corners),
          octree_tf_(octree_tf) {
      for (fcl::Vector3d& x : corners_) x -= middle_;
    }

    const fcl::Vector3d middle_;
    const BoxShape box_;
    TrianglePoints<double> corners_;
    const fcl::Transform3d& octree_tf_;
  };
  LeafPair leafPair(const Cell<S>& cell, int triangle) {
    ++work_.leaf_tests;
    const VertexIndices v = triangles_.verticesOf(static_cast<unsigned>(triangle));
    const auto corner = [&](std::size_t k) -> fcl::Vector3d {
      return to_octree_(triangles_.vertices[v[k]]);
    };
    return LeafPair(cell.box, {corner(0), corner(1), corner(2)}, octree_tf_);
  }

  std::intptr_t id(const Cell<S>& cell) const { return octree_.id(cell); }

 private:
  const MeshView<typename Nodes::P> triangles_;
  const Nodes nodes_;
  const OctreeCells<S> octree_;
  const fcl::Transform3d octree_tf_;
  const RelativePlacement to_octree_;
  const IntoOctree<S> into_octree_;
  QueryWork work_;
};

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
