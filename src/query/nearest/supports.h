#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "boxes/wide_tree.h"
#include "query/nearest/triangle_separation.h"

namespace adaptive_bvh {

/// Returns, as a bit for each box of a node, whether its contents may be near the other body.
using NearLanes = std::function<unsigned(int node)>;

/// How far the vertices in each box of a four-wide tree extend along one direction (values of their
/// support function), for the part of the tree that may be near another body.
class Supports {
 public:
  /// Four numbers, one for each box of a node.
  struct alignas(32) Four {
    double lane[4];
  };

  /// A subtree of at most this many nodes is in the part as a whole or not at all.
  static constexpr int kSmall = 128;

  /// Sets the part of the tree: the root, and the nodes below boxes that `near` reports. Returns
  /// the number of positions that `compute` reads.
  std::size_t setPart(const WideTree& tree, const NearLanes& near);
  /// Computes the extents from the point `from` along a direction of length 1, in the mesh's frame
  /// and unit. Their rounding error is that of TriangleSeparation::separation.
  void compute(const WideTree& tree, const fcl::Vector3d* vertices, const fcl::Vector3d& from,
               const fcl::Vector3d& direction);
  /// Whether a node is in the part.
  bool covers(int node) const;
  /// Returns the extents of a node's boxes: -infinity for a box that is unused or not near.
  const Four& operator[](int node) const { return extents_[static_cast<std::size_t>(node)]; }
  /// The largest extent in the whole part.
  double largest() const { return *std::max_element(extents_[0].lane, extents_[0].lane + 4); }

 private:
  /// A piece of the part: a single node, or a small subtree, whose nodes have consecutive numbers.
  struct Run {
    int begin, end;                    ///< range of node numbers
    unsigned lanes;                    ///< the boxes of the first node that may be near
    std::size_t first_slot, end_slot;  ///< slots of its leaves; equal for a single node
  };
  void computeNode(const WideTree& tree, int number);

  std::vector<Run> runs_;  ///< the part, in the order of nodes: children follow their parent
  std::vector<Run> open_;  ///< setPart: the subtrees still to divide
  std::vector<double> slot_extents_;
  std::vector<Four> extents_;  ///< by node number; set for nodes of the part
};

/// Separations of the nodes of two meshes' trees along one line, TriangleSeparation's: supports of
/// both meshes toward each other. If the nearest points of two bodies are nearly known, the line
/// between them separates nodes that boxes, which lie along other axes, do not. In double
/// precision, so that parallel faces are separated by their distance. docs/bounds.md, 18.
class LineSeparation {
 public:
  /// Sets the parts of both trees (Supports). Returns the cost of `compute`, in box tests.
  long setParts(const WideTree& first, const NearLanes& near1, const WideTree& second,
                const NearLanes& near2) {
    return static_cast<long>(first_.setPart(first, near1) + second_.setPart(second, near2)) / 2;
  }
  /// An upper bound of what setParts returns.
  static long largestCost(const WideTree& first, const WideTree& second) {
    return static_cast<long>(first.slots().size() + second.slots().size()) / 2;
  }
  void compute(const WideTree& first, const WideTree& second, const TriangleSeparation& triangles);
  /// Whether both nodes are in the parts. If not, they are not near each other. Call `apart` and
  /// `extents1`, `extents2` only for nodes in the parts.
  bool covers(int first, int second) const {
    return first_.covers(first) && second_.covers(second);
  }
  /// Returns how far the contents of a node's boxes extend toward the other mesh, from the line's
  /// point on their own mesh; extent1 and extent2 return the largest extents of all boxes.
  const Supports::Four& extents1(int node) const { return first_[node]; }
  const Supports::Four& extents2(int node) const { return second_[node]; }
  double extent1() const { return first_.largest(); }
  double extent2() const { return second_.largest(); }
  void setLimit(double distance) { room_ = offset_ - distance; }  ///< for `apart`

  /// Returns which boxes i and j of two nodes are at least the limit apart, as bits 4 j + i.
  ADAPTIVE_BVH_INLINE unsigned apart(int first, int second) const {
    const double *const extent1 = first_[first].lane, *const extent2 = second_[second].lane;
    const Pack<double> boxes01 = packs::load(extent1), boxes23 = packs::load(extent1 + 2),
                       room = packs::all(room_);
    unsigned bits = 0;
    for (int j = 0; j < 4; ++j) {
      const Pack<double> e2 = packs::all(extent2[j]);
      bits |= (packs::bitsOf2(boxes01 + e2 <= room) | packs::bitsOf2(boxes23 + e2 <= room) << 2)
              << (4 * j);
    }
    return bits;
  }

 private:
  Supports first_, second_;
  double offset_ = 0;  ///< distance of the line's two points along the line
  double room_ = 0;    ///< two boxes are apart if their extents sum up to at most this
};

}  // namespace adaptive_bvh
