#pragma once

#include "boxes/tree_walk.h"
#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// Returns the vertex of a mesh that is farthest along a direction, or nearly so: the best vertex
/// in a bounded number of nodes, visited depth first, the box that extends farthest first. So the
/// time hardly depends on the size of the mesh. All arguments are in the mesh's frame.
inline fcl::Vector3d farthestPoint(const WideTree& tree, const fcl::Vector3d* vertices,
                                   const fcl::Vector3d& along) {
  constexpr int kMostNodes = 48;
  const fcl::Vector3f in_tree = (tree.toBody() * along).stableNormalized().cast<float>();
  fcl::Vector3d best = vertices[tree.corners(0)[0]];
  float best_extent = std::numeric_limits<float>::lowest();
  int visited = 0;
  // The key of a box is minus its extent along the direction.
  const auto keysOf = [&](const WideNode& node) -> Float4 {
    ++visited;
    Float4 extent = float4::all(0);
    for (int k = 0; k < 3; ++k)
      extent += float4::all(in_tree[k]) * (in_tree[k] > 0 ? node.boxes.high[k] : node.boxes.low[k]);
    return -extent;
  };
  TreeWalk(tree).nearestFirst(
      keysOf, [&] { return -best_extent; },
      [&](const WideNode& node, unsigned lanes, const Float4&) {
        for (; lanes; lanes &= lanes - 1) {
          const Int4& corners =
              tree.corners(static_cast<unsigned>(node.first + __builtin_ctz(lanes)));
          for (int k = 0; k < 3; ++k) {
            const fcl::Vector3d& x = vertices[corners[k]];
            const float extent = in_tree.dot((tree.toBody() * (x - tree.origin())).cast<float>());
            if (extent > best_extent) best = x;
            best_extent = std::max(best_extent, extent);
          }
        }
        return visited >= kMostNodes;  // whether to stop
      });
  return best;
}

}  // namespace adaptive_bvh
