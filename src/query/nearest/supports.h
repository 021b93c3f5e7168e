#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "boxes/wide_tree.h"
#include "query/nearest/triangle_separation.h"

namespace adaptive_bvh {

/// Returns, as bits, which boxes of a node may hold triangles near the other mesh.
using NearLanes = std::function<unsigned(int node)>;

/// How far the contents of each box of a four-wide tree extend along one direction, for the part of
/// the tree that may be near another mesh.
class Supports {
 public:
  /// Four numbers, one for each box of a node.
  struct alignas(32) Four {
    double of[4];
  };

  /// The part of the tree consists of whole subtrees of at most this many nodes.
  static constexpr int kSmall = 128;

  /// Sets the part of the tree. Returns the number of positions that `compute` reads.
  std::size_t setPart(const WideTree& tree, const NearLanes& near);
  /// Computes the extents from the point `from` along a direction of length 1, in the mesh's frame
  /// and unit. Their rounding error is that of TriangleSeparation::separation.
  void compute(const WideTree& tree, const fcl::Vector3d* vertices, const fcl::Vector3d& from,
               const fcl::Vector3d& direction);
  /// Whether a node is in the part.
  bool covers(int node) const;
  /// Extents of the boxes of a node in the part. -infinity for a missing box, or one that is not
  /// near.
  const Four& operator[](int node) const { return extents_[static_cast<std::size_t>(node)]; }
  /// The largest extent in the whole part.
  double largest() const { return *std::max_element(extents_[0].of, extents_[0].of + 4); }

 private:
  /// Consecutive nodes: a node of which some boxes are near, or a node with its whole subtree.
  struct Run {
    int begin, end;
    unsigned lanes;
    std::size_t first_slot, end_slot;  ///< of the leaves of the run
  };
  void computeNode(const WideTree& tree, int n);

  std::vector<Run> runs_, open_;
  std::vector<double> of_slot_;
  std::vector<Four> extents_;
};

/// The separations of the nodes of two trees along one line. If the nearest points of two bodies
/// are nearly known, the line between them separates nodes that boxes, which lie along other axes,
/// do not. Computed in double precision, so that parallel faces are separated by their distance.
/// docs/bounds.md, 18.
class LineSeparation {
 public:
  /// Sets the parts of both trees. Returns the cost of `compute`, in box tests.
  long setParts(const WideTree& first, const NearLanes& near1, const WideTree& second,
                const NearLanes& near2) {
    return static_cast<long>(first_.setPart(first, near1) + second_.setPart(second, near2)) / 2;
  }
  /// An upper bound of what setParts returns.
  static long largestCost(const WideTree& first, const WideTree& second) {
    return static_cast<long>(first.slots().size() + second.slots().size()) / 2;
  }
  void compute(const WideTree& first, const WideTree& second, const TriangleSeparation& triangles);
  /// Whether two nodes may be near each other. Call `apart` only for such nodes and the nodes below
  /// them.
  bool covers(int first, int second) const {
    return first_.covers(first) && second_.covers(second);
  }
  /// How far the contents of a node's boxes extend toward the other mesh, from the points of the
  /// line.
  const Supports::Four& extents1(int node) const { return first_[node]; }
  const Supports::Four& extents2(int node) const { return second_[node]; }
  /// The largest extent of all.
  double extent1() const { return first_.largest(); }
  double extent2() const { return second_.largest(); }
  /// Sets the distance with which separations are compared.
  void setLimit(double distance) { rest_ = offset_ - distance; }

  /// Returns which boxes of two nodes hold triangles at least the limit apart: bit 4 j + i for box
  /// i of the first and j of the second.
  ADAPTIVE_BVH_INLINE unsigned apart(int first, int second) const {
    const double *const h1 = first_[first].of, *const h2 = second_[second].of;
    const Pack<double> low = packs::load(h1), high = packs::load(h1 + 2), rest = packs::all(rest_);
    unsigned bits = 0;
    for (int j = 0; j < 4; ++j) {
      const Pack<double> other = packs::all(h2[j]);
      bits |= (packs::bitsOf2(low + other <= rest) | packs::bitsOf2(high + other <= rest) << 2)
              << (4 * j);
    }
    return bits;
  }

 private:
  Supports first_, second_;
  double offset_ = 0;  ///< along the line, from the first of its points to the second
  double rest_ = 0;    ///< two extents separate if their sum is at most this
};

}  // namespace adaptive_bvh
