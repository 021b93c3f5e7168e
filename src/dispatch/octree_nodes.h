#pragma once

#include "dispatch/cell_separation.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// A node of a tree over a mesh's triangles: an FCL node, or a box of a WideNode (lane -1: all).
struct MeshNode {
  int node = 0, lane = -1;
};

/// The interface of a tree over the triangles of a mesh, for searches with an octree.
class MeshNodes {
 public:
  virtual ~MeshNodes() = default;
  virtual bool isLeaf(MeshNode node) const = 0;
  virtual int triangle(MeshNode leaf) const = 0;
  virtual SweptBox body(MeshNode node) const = 0;  ///< a node's volume
  /// The size of a node's volume, which is compared with that of a cell as in FCL.
  virtual double size(MeshNode node) const = 0;
  /// Stores the children of a node, and returns their number.
  virtual int below(MeshNode node, MeshNode (&nodes)[4]) const = 0;
  virtual void recordVisit(MeshNode) const {}  ///< for traversal statistics
  /// Receives the numbers of tests: of nodes with cells, and of triangles with cells.
  virtual void recordTests(std::size_t, std::size_t) const {}
};

/// The nodes of a mesh's four-wide tree.
class WideNodes final : public MeshNodes {
 public:
  explicit WideNodes(const WideTree& tree) : tree_(tree), axes_(tree.coordinates().axes()) {}

  bool isLeaf(MeshNode node) const override { return node.lane >= 0 && wide(node).isLeaf(); }
  int triangle(MeshNode leaf) const override {
    return tree_.triangle(static_cast<unsigned>(wide(leaf).first + leaf.lane));
  }
  SweptBox body(MeshNode node) const override {
    const Box box = boxOf(node);
    const Float4 center = box.center(), half = box.halfSides();
    const double unit = 1 / tree_.scale();
    SweptBox body;
    body.axes = axes_;
    body.radius = 0;
    body.middle = tree_.origin();
    for (int k = 0; k < 3; ++k) {
      body.middle += axes_.col(k) * (unit * double(center[k]));
      body.half[k] = axes_.col(k) * (unit * double(half[k]));
    }
    // Coordinates in the tree are below 2, so that |x| + |y| + |z| < 6; times 3, for rounding.
    body.coordinate_sum = tree_.origin().lpNorm<1>() + 18 * unit;
    return body;
  }
  double size(MeshNode node) const override {
    const Box box = boxOf(node);
    return double(float4::sum(box.high - box.low)) / tree_.scale();
  }
  int below(MeshNode node, MeshNode (&nodes)[4]) const override {
    const int below = node.lane < 0 ? node.node : wide(node).below[node.lane];
    const int count = int(tree_.nodes()[below].count);
    for (int i = 0; i < count; ++i) nodes[i] = {below, i};
    return count;
  }

 private:
  const WideNode& wide(MeshNode node) const { return tree_.nodes()[node.node]; }
  Box boxOf(MeshNode node) const {
    if (node.lane >= 0) return wide(node).boxes.box(node.lane);
    Box all = wide(node).boxes.box(0);
    for (int i = 1; i < int(wide(node).count); ++i) all.add(wide(node).boxes.box(i));
    return all;
  }

  const WideTree& tree_;
  const fcl::Matrix3d axes_;
};

}  // namespace adaptive_bvh
