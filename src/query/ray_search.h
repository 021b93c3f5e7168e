#pragma once

#include <cmath>
#include <limits>

#include "boxes/open_nodes.h"
#include "boxes/wide_tree.h"
#include "query/placed_mesh.h"
#include "triangles/ray_triangle.h"

namespace adaptive_bvh {

/// The triangles that a ray meets, by the four-wide tree of a mesh. Boxes are tested in single
/// precision, from where the ray enters the body on; triangles exactly: docs/bounds.md, 16.
template <typename S>
class RaySearch {
 public:
  explicit RaySearch(const MeshState<S>& mesh)
      : mesh_(mesh), tree_(mesh.tree), open_(tree_.depth()) {}

  /// Calls found(triangle, hit) for each hit, in any order; it returns the t up to which further
  /// ones are of interest. Rays of one direction, one after the other, are prepared once.
  template <typename Found>
  void search(const fcl::Vector3d& origin, const fcl::Vector3d& direction, Found&& found) {
    if (direction != direction_) setDirection(direction);
    if (!setOrigin(origin)) return;
    test_.setOrigin(origin);
    open_.start();
    while (!open_.isEmpty()) {
      const OpenNodes::Node at = open_.pop();
      if (at.key <= end_) visit(tree_.nodes()[at.number], found);
    }
  }

 private:
  void setDirection(const fcl::Vector3d& direction) {
    direction_ = direction;
    test_ = RayTriangle(direction);
    // Near 1, so that a direction of any length is normalized exactly.
    exponent_ = std::ilogb(direction.template lpNorm<Eigen::Infinity>());
    const fcl::Vector3d scaled(std::ldexp(direction[0], -exponent_),
                               std::ldexp(direction[1], -exponent_),
                               std::ldexp(direction[2], -exponent_));
    along_ = tree_.toBody() * scaled.normalized() / tree_.scale();
    per_t_ = scaled.norm() * tree_.scale();
    for (int k = 0; k < 3; ++k) {
      const auto slope = static_cast<float>(along_[k]);
      constexpr float kLeast = 1e-30f;
      const float inverse = 1 / (std::fabs(slope) > kLeast ? slope : std::copysign(kLeast, slope));
      is_backward_[k] = inverse < 0;  // also of a slope of -0
      inverse_[k] = float4::all(inverse);
    }
  }
  /// False when the ray passes by the body. Lengths along the ray are in the tree's unit, from
  /// where it comes near the body: there all coordinates are below 8.
  bool setOrigin(const fcl::Vector3d& origin) {
    const fcl::Vector3d from = tree_.toBody() * (origin - tree_.origin());
    end_ = std::numeric_limits<float>::max();
    rounding_ = from.template lpNorm<Eigen::Infinity>() * kDouble;
    has_boxes_ = rounding_ <= 1;
    if (!has_boxes_) return meetEveryBox();
    constexpr double kReach = 2.5;  // all coordinates of the body are below 2
    const double middle = -from.dot(along_);
    constexpr double kRadius = 3.6;  // > sqrt(3) 2
    if (!((from + middle * along_).norm() <= kRadius + rounding_)) return false;
    if (middle < -(kRadius + kReach + rounding_)) return false;
    start_ = std::max(0., middle - kRadius - rounding_);
    const fcl::Vector3d entry = from + start_ * along_;
    const auto error = static_cast<float>(kError + 4 * rounding_);
    for (int k = 0; k < 3; ++k) {
      const float at = static_cast<float>(entry[k]), inverse = inverse_[k][0];
      enter_[k] = float4::all((is_backward_[k] ? at - error : at + error) * inverse);
      leave_[k] = float4::all((is_backward_[k] ? at + error : at - error) * inverse);
    }
    return true;
  }
  /// From so far away that the body is smaller than what is rounded off.
  bool meetEveryBox() {
    for (int k = 0; k < 3; ++k) inverse_[k] = enter_[k] = leave_[k] = float4::all(0);
    direction_.setZero();  // to be prepared again
    return true;
  }
  /// What lies at `t` or before it remains of interest, also where it lies behind it by less than
  /// single precision tells.
  void setEnd(double t) {
    if (!has_boxes_) return;
    const double reach = std::ldexp(t, exponent_) * per_t_ * (1 + 1. / (1 << 20));
    const double end = reach - start_ + 4 * rounding_ + 1e-4;
    end_ = end < kFar ? static_cast<float>(end) : std::numeric_limits<float>::max();
  }

  /// Where the ray enters four boxes, each larger by the error. Returns a bit for each that it
  /// meets before its end.
  ADAPTIVE_BVH_INLINE unsigned meets(const Boxes4& boxes, Float4& enter) const {
    using float4::lower;
    using float4::upper;
    enter = float4::all(0);
    Float4 leave = float4::all(end_);
    for (int k = 0; k < 3; ++k) {
      const Float4 &near = is_backward_[k] ? boxes.high[k] : boxes.low[k],
                   &far = is_backward_[k] ? boxes.low[k] : boxes.high[k];
      enter = upper<Float4>(enter, near * inverse_[k] - enter_[k]);
      leave = lower<Float4>(leave, far * inverse_[k] - leave_[k]);
    }
    return float4::bits(enter <= leave);
  }

  template <typename Found>
  ADAPTIVE_BVH_INLINE void visit(const WideNode& node, Found&& found) {
    Float4 enter;
    // A lane without a box is empty, so no ray meets it, unless every box counts.
    unsigned lanes = meets(node.boxes, enter) & ((1u << node.count) - 1);
    if (!node.isLeaf()) return open_.push(node, lanes, enter);
    for (; lanes; lanes &= lanes - 1)
      testTriangle(static_cast<unsigned>(node.first + __builtin_ctz(lanes)), found);
  }
  template <typename Found>
  void testTriangle(unsigned place, Found&& found) {
    const Int4& v = tree_.corners(place);
    const auto point = [&](int k) -> fcl::Vector3d {
      return mesh_.vertices[static_cast<std::size_t>(v[k])].template cast<double>();
    };
    RayTriangle::Hit hit;
    if (test_.meets(point(0), point(1), point(2), hit)) setEnd(found(tree_.triangle(place), hit));
  }

  static constexpr double kDouble = 1. / (1ull << 48), kError = 96. / (1 << 24), kFar = 1e30;

  const MeshState<S>& mesh_;
  const WideTree& tree_;
  OpenNodes open_;
  RayTriangle test_{fcl::Vector3d::UnitX()};
  fcl::Vector3d direction_ = fcl::Vector3d::Zero(), along_;
  Float4 inverse_[3], enter_[3], leave_[3];
  bool is_backward_[3] = {}, has_boxes_ = true;
  int exponent_ =
      0;  ///< of the direction's largest component; lengths by t are per_t_ * 2^exponent_
  double start_ = 0, per_t_ = 1, rounding_ = 0;
  float end_ = 0;
};

}  // namespace adaptive_bvh
