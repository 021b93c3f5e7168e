#pragma once

#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

#include "adaptive_bvh/build_flags.h"

namespace adaptive_bvh {

/// How a model builds its tree.
enum class HierarchyStrategy {
  /// FCL's own: a node's triangles are split at the mean of their centres along its longest axis.
  TopDown,
  /// By the connectivity of the mesh, level by level (thesis appendix): groups that share the
  /// greatest length of edges are joined. Neighbours in the mesh stay neighbours in the tree
  /// however the mesh folds. Any input is allowed: components are merged by proximity, and
  /// triangles
  /// without shared vertices are connected by the positions of their corners. The default, because
  /// update and query together are 1.1 to 1.25 times as fast on deforming meshes
  /// (docs/hierarchy.md).
  BottomUp,
};

/// "top-down" or "bottom-up"; never null.
const char* toString(HierarchyStrategy strategy);

/// One level of a tree: all nodes at one depth.
struct LevelQuality {
  int nodes = 0;      ///< number of nodes, including leaves
  int leaves = 0;     ///< number of leaves
  double volume = 0;  ///< sum of the bounding volumes; unit of length cubed
  double area = 0;    ///< sum of their surface areas; unit of length squared
  /// Mean aspect ratio of the inner nodes: longer side over shorter side of the rectangle grown by
  /// the radius on all sides; 1 is a square. Nodes that are line segments do not count. 0 if there
  /// is no inner node.
  double aspect_ratio = 0;
  /// Share of the smaller child that lies within the larger one, 0 to 1; mean over the inner nodes.
  /// Estimated by 64 sample points a pair, spread evenly over the smaller child's rectangle and
  /// thickness.
  double sibling_overlap = 0;
};

/// Quality of a tree in its present state, including inflation.
struct HierarchyQuality {
  int depth = 0;       ///< edges from the root to the farthest leaf; FCL recurses that deep
  double balance = 0;  ///< the least depth possible, ceil(log2 n), over `depth`; 1 for one leaf
  std::vector<LevelQuality> levels;  ///< levels[d]: the nodes at depth d; depth + 1 entries

  /// As in LevelQuality, over all inner nodes.
  double aspect_ratio = 0;
  double sibling_overlap = 0;  ///< as in LevelQuality, over all inner nodes
};

/// Measures any FCL tree of RSS or OBBRSS; for OBBRSS its rectangle-swept spheres, which distances
/// use. Returns depth 0 and no levels if there is no tree. Visits all nodes once and reads no
/// triangle.
template <typename BV>
HierarchyQuality measureHierarchy(const fcl::BVHModel<BV>& model);

/// Returns the nodes that represent the whole mesh at one depth: the nodes at that depth and the
/// leaves above it, left to right. Each triangle is below exactly one of them.
template <typename BV>
std::vector<int> nodesAtDepth(const fcl::BVHModel<BV>& model, int depth) {
  std::vector<int> cut;
  std::vector<std::pair<int, int>> open;  // node and its depth
  if (model.getNumBVs() > 0) open.emplace_back(0, 0);
  while (!open.empty()) {
    const auto [i, at] = open.back();
    open.pop_back();
    if (at == depth || model.getBV(i).isLeaf()) {
      cut.push_back(i);
    } else {
      open.emplace_back(model.getBV(i).rightChild(), at + 1);
      open.emplace_back(model.getBV(i).leftChild(), at + 1);
    }
  }
  return cut;
}

/// Returns the primitives (triangles) below a node, left to right.
template <typename BV>
std::vector<int> primitivesBelow(const fcl::BVHModel<BV>& model, int node) {
  std::vector<int> primitives, open{node};
  while (!open.empty()) {
    const auto& at = model.getBV(open.back());
    open.pop_back();
    if (at.isLeaf()) {
      primitives.push_back(at.primitiveId());
    } else {
      open.push_back(at.rightChild());
      open.push_back(at.leftChild());
    }
  }
  return primitives;
}

}  // namespace adaptive_bvh
