#pragma once

#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

#include "adaptive_bvh/build_flags.h"

namespace adaptive_bvh {

/// How the tree of a model is built.
enum class HierarchyStrategy {
  /// FCL's own: a node's triangles are split at the mean of their centres along its longest axis.
  TopDown,
  /// By the connectivity of the mesh, level by level (thesis appendix): groups that share the
  /// greatest length of edges are joined. Neighbours in the mesh stay neighbours in the tree
  /// however the mesh folds. Any input will do: components are merged by proximity, and triangles
  /// without shared vertices are connected by the positions of their corners. The default, because
  /// it measures better on deforming meshes: 1.1 to 1.25 times in update + query
  /// (docs/hierarchy.md).
  BottomUp,
};

/// "top-down" or "bottom-up"; never null.
const char* toString(HierarchyStrategy strategy);

/// One level of a tree: all nodes at one depth.
struct LevelQuality {
  int nodes = 0;      ///< leaves included
  int leaves = 0;     ///< of them
  double volume = 0;  ///< of the bounding volumes, summed; unit of length cubed
  double area = 0;    ///< of their surfaces, summed; unit of length squared
  /// Of inner nodes: the longer side over the shorter one, of the rectangle grown by the radius on
  /// all sides. Mean over the nodes; 1 is a square. Nodes that are line segments do not count. 0
  /// when there is none.
  double aspect_ratio = 0;
  /// How much of the smaller child lies within the larger, 0 to 1; mean over the inner nodes. By
  /// 64 sample points a pair, spread evenly over the smaller child's rectangle and thickness.
  double sibling_overlap = 0;
};

/// How good a tree is, as it stands: inflation counts.
struct HierarchyQuality {
  int depth = 0;       ///< edges from the root to the farthest leaf; FCL recurses that deep
  double balance = 0;  ///< the least depth possible, ceil(log2 n), over `depth`; 1 for one leaf
  std::vector<LevelQuality> levels;  ///< levels[d]: the nodes at depth d; depth + 1 entries

  /// As in LevelQuality, over all inner nodes.
  double aspect_ratio = 0;
  double sibling_overlap = 0;  ///< as in LevelQuality, over all inner nodes
};

/// Measures any FCL tree of RSS or OBBRSS; of OBBRSS its rectangle-swept spheres, which distances
/// use. Empty (depth 0, no levels) without a tree. Walks all nodes once; no triangle is read.
template <typename BV>
HierarchyQuality measureHierarchy(const fcl::BVHModel<BV>& model);

/// The nodes that stand for the whole mesh at one depth: those at that depth and the leaves above
/// it, left to right. Each triangle is below exactly one of them.
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

/// The primitives (triangles) below a node, left to right.
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
