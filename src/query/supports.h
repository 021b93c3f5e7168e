#pragma once

#include <vector>

#include "query/tree_pair.h"

namespace adaptive_bvh {

/// How far everything below each box of a four-wide tree reaches along one direction, exactly up to
/// rounding.
class Supports {
 public:
  /// Bounds the error of a number for a direction of length 1 in the coordinates of the tree, also
  /// of a direction that was rounded to single precision, and its share of a rounded sum of two.
  static constexpr double kError = 32. / (1 << 24);

  /// `direction`: in the tree's coordinates.
  void compute(const WideTree& tree, const Float4& direction);
  /// Of the boxes of a node, four numbers.
  const Float4& operator[](int node) const { return reaches_[static_cast<std::size_t>(node)]; }

 private:
  std::vector<float> of_slot_;
  std::vector<Float4> reaches_;
};

/// The separations of the nodes of two trees along one direction: of two bodies whose nearest
/// points are nearly known, the line between these separates nodes where boxes, which lie along
/// other axes, do not. docs/bounds.md, 18.
class LineSeparation {
 public:
  /// So many tests of boxes take as long as `compute`.
  static long cost(const WideTree& first, const WideTree& second) {
    return static_cast<long>(first.slots().size() + second.slots().size()) / 4;
  }
  /// `direction`: from the first body to the second, of about length 1, in the first tree's
  /// coordinates. `frame` takes the second tree to the first. Of trees whose sizes differ by so
  /// much that single precision cannot express both nothing is separated.
  void compute(const WideTree& first, const WideTree& second, const RelativeFrame& frame,
               const fcl::Vector3d& direction);
  /// The distance that separations are compared with, in the first tree's unit.
  void setLimit(double distance);

  /// Which boxes of two nodes hold triangles that are at least the limit apart: bit 4 j + i for box
  /// i of the first and j of the second.
  ADAPTIVE_BVH_INLINE unsigned apart(int first, int second) const {
    const Float4 &h1 = first_[first], &h2 = second_[second];
    const Float4 rest = float4::all(rest_);
    return float4::bits(h1 + float4::broadcast<0>(h2) <= rest) |
           float4::bits(h1 + float4::broadcast<1>(h2) <= rest) << 4 |
           float4::bits(h1 + float4::broadcast<2>(h2) <= rest) << 8 |
           float4::bits(h1 + float4::broadcast<3>(h2) <= rest) << 12;
  }

 private:
  Supports first_, second_;
  double along_ = 0;   ///< how far the second tree's origin lies along the direction
  double length_ = 1;  ///< of the direction
  double error_ = 0;
  float rest_ = 0;  ///< sums of two supports up to this separate
};

}  // namespace adaptive_bvh
