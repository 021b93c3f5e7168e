#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "base/scratch.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {

/// Finds two triangles, one of each mesh, that are approximately the closest. Their distance is an
/// upper bound of the distance of the meshes. A beam search: descends both four-wide trees level by
/// level, and keeps the kKept pairs of nodes whose boxes have the nearest centres.
inline TrianglePair closeTriangles(const PairOfMeshes& meshes) {
  const TreePair trees(meshes.first, meshes.second);
  constexpr std::size_t kKept = 8;
  constexpr float kFar = 1e30f;
  struct Pair {
    int first, second;  ///< nodes; in the end, triangles
    float distance;     ///< squared, of the doubled centres
    bool operator<(const Pair& other) const { return distance < other.distance; }
  };
  const RelativeFrame& frame = trees.frame();
  Scratch<Pair> pairs{{0, 0, 0}}, below;
  // Adds the pairs of a box i of node a and j of node b, as firstOf(a, i), secondOf(b, j).
  const auto addBoxes = [&](const Pair& pair, const auto& firstOf, const auto& secondOf) {
    const WideNode &a = trees.first().nodes()[pair.first], &b = trees.second().nodes()[pair.second];
    const Boxes4 of_second = frame(b.boxes);
    for (int i = 0; i < int(a.count); ++i)
      for (int j = 0; j < int(b.count); ++j) {
        float squared = 0;
        for (int k = 0; k < 3; ++k) {
          const float difference =
              a.boxes.low[k][i] + a.boxes.high[k][i] - (of_second.low[k][j] + of_second.high[k][j]);
          squared += difference * difference;
        }
        if (!(squared < kFar)) squared = kFar;  // also for NaN
        below.push_back({firstOf(a, i), secondOf(b, j), squared});
      }
  };
  // Replaces `pairs` by the nearest of `below`.
  const auto keepNearest = [&] {
    const std::size_t kept = std::min(kKept, below.size());
    std::partial_sort(below.begin(), below.begin() + std::ptrdiff_t(kept), below.end());
    below.resize(kept);
    pairs.swap(below);
    below.clear();
  };
  const auto areLeaves = [&](const Pair& pair) {
    return trees.first().nodes()[pair.first].isLeaf() &&
           trees.second().nodes()[pair.second].isLeaf();
  };
  while (!std::all_of(pairs.begin(), pairs.end(), areLeaves)) {
    for (const Pair& pair : pairs) {
      if (areLeaves(pair)) {
        below.push_back(pair);
        continue;
      }
      addBoxes(
          pair, [&](const WideNode& a, int i) { return a.isLeaf() ? pair.first : a.below[i]; },
          [&](const WideNode& b, int j) { return b.isLeaf() ? pair.second : b.below[j]; });
    }
    keepNearest();
  }
  // The boxes of leaves are those of triangles.
  for (const Pair& pair : pairs)
    addBoxes(
        pair,
        [&](const WideNode& a, int i) { return trees.first().triangle(unsigned(a.first + i)); },
        [&](const WideNode& b, int j) { return trees.second().triangle(unsigned(b.first + j)); });
  keepNearest();
  TrianglePair nearest{0, 0};
  double least = std::numeric_limits<double>::infinity();
  for (const Pair& pair : pairs) {
    const TrianglePair triangles{unsigned(pair.first), unsigned(pair.second)};
    const double distance = meshes.gap(triangles).distance;
    if (!(distance < least)) continue;
    least = distance;
    nearest = triangles;
  }
  return nearest;
}

}  // namespace adaptive_bvh
