#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "query/open_nodes.h"
#include "query/placed_mesh.h"
#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// A ray and a triangle, watertight (Woop, Benthin, Wald 2013): the triangle's corners are sheared
/// so that the ray is an axis; then the signs of three areas decide. Two triangles with a side in
/// common compute the same area for it but for its sign, and the sign is exact for the sheared
/// corners.
class RayTriangle {
 public:
  struct Hit {
    double t, u, v;
    bool is_front;      ///< seen counter-clockwise
    bool is_on_a_side;  ///< or on a corner
  };

  RayTriangle(const fcl::Vector3d& origin, const fcl::Vector3d& direction) : origin_(origin) {
    direction.cwiseAbs().maxCoeff(&z_);
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    if (direction[z_] < 0) std::swap(x_, y_);
    shear_x_ = direction[x_] / direction[z_];
    shear_y_ = direction[y_] / direction[z_];
    per_depth_ = 1 / direction[z_];
  }

  /// Whether the line of the ray meets the triangle; t may be negative.
  bool meets(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
             Hit& hit) const {
    const Sheared p = sheared(a), q = sheared(b), r = sheared(c);
    const double u = area(r, q), v = area(p, r), w = area(q, p);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
    const double sum = u + v + w;
    if (sum == 0) return false;
    hit.t = (u * p.z + v * q.z + w * r.z) / sum * per_depth_;
    hit.u = v / sum;
    hit.v = w / sum;
    hit.is_front = sum > 0;
    hit.is_on_a_side = u == 0 || v == 0 || w == 0;
    return true;
  }

 private:
  struct Sheared {
    double x, y, z;
  };
  Sheared sheared(const fcl::Vector3d& corner) const {
    const fcl::Vector3d d = corner - origin_;
    return {d[x_] - shear_x_ * d[z_], d[y_] - shear_y_ * d[z_], d[z_]};
  }
  /// With the exact sign: products that are equal once rounded differ by what was rounded off.
  static double area(const Sheared& a, const Sheared& b) {
    const double left = a.x * b.y;
    const double right = a.y * b.x;
    if (left != right) return left - right;
    return std::fma(a.x, b.y, -left) - std::fma(a.y, b.x, -right);
  }

  fcl::Vector3d origin_;
  int x_, y_, z_;
  double shear_x_, shear_y_, per_depth_;
};

/// The triangles that a ray meets, by the four-wide tree of a model. Boxes are tested in single
/// precision, from where the ray enters the body on; triangles in double: docs/bounds.md, 16.
template <typename BV>
class RaySearch {
 public:
  using S = typename BV::S;

  RaySearch(const fcl::BVHModel<BV>& model, const WideTree<S>& tree)
      : model_(model), tree_(tree), open_(tree.depth()) {}

  /// Calls found(triangle, hit) for each hit with t >= 0, in any order; it returns the t up to
  /// which further ones are of interest.
  template <typename Found>
  void search(const fcl::Vector3d& origin, const fcl::Vector3d& direction, Found&& found) {
    if (!setRay(origin, direction)) return;
    const RayTriangle test(origin, direction);
    open_.start();
    while (!open_.isEmpty()) {
      const OpenNodes::Node at = open_.pop();
      if (at.key <= end_) visit(tree_.nodes()[at.number], test, found);
    }
  }

 private:
  /// False when the ray passes by the body. Lengths along the ray are in the tree's unit, from
  /// where it comes near the body: there all coordinates are below 8.
  bool setRay(const fcl::Vector3d& origin, const fcl::Vector3d& direction) {
    const fcl::Vector3d from = tree_.toBody() * (origin - tree_.origin());
    const fcl::Vector3d along = tree_.toBody() * direction.stableNormalized() / tree_.scale();
    per_t_ = direction.stableNorm() * tree_.scale();
    constexpr double kReach = 2.5;  // all coordinates of the body are below 2
    const double middle = -from.dot(along);
    constexpr double kRadius = 3.6;  // > sqrt(3) 2
    const double size = from.template lpNorm<Eigen::Infinity>();
    const double rounding = size * kDouble;
    if (!((from + middle * along).norm() <= kRadius + rounding)) return false;
    if (middle < -(kRadius + kReach + rounding)) return false;
    start_ = std::max(0., middle - kRadius - rounding);
    const fcl::Vector3d entry = from + start_ * along;
    const auto error = static_cast<float>(kError + 4 * rounding);
    for (int k = 0; k < 3; ++k) {
      const auto slope = static_cast<float>(along[k]), at = static_cast<float>(entry[k]);
      constexpr float kLeast = 1e-30f;
      const float inverse = 1 / (std::fabs(slope) > kLeast ? slope : std::copysign(kLeast, slope));
      is_backward_[k] = slope < 0;
      inverse_[k] = float4::all(inverse);
      enter_[k] = float4::all((is_backward_[k] ? at - error : at + error) * inverse);
      leave_[k] = float4::all((is_backward_[k] ? at + error : at - error) * inverse);
    }
    end_ = std::numeric_limits<float>::max();
    return true;
  }
  void setEnd(double t) {
    const double end = (t * per_t_ - start_) * (1 + 1. / (1 << 20)) + 1e-4;
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
  ADAPTIVE_BVH_INLINE void visit(const WideNode& node, const RayTriangle& test, Found&& found) {
    Float4 enter;
    unsigned lanes = meets(node.boxes, enter);
    if (!node.isLeaf()) return open_.push(node, lanes, enter);
    for (; lanes; lanes &= lanes - 1)
      testTriangle(static_cast<unsigned>(node.first + __builtin_ctz(lanes)), test, found);
  }
  template <typename Found>
  void testTriangle(unsigned place, const RayTriangle& test, Found&& found) {
    const Int4& v = tree_.vertices(place);
    RayTriangle::Hit hit;
    if (test.meets(model_.vertices[v[0]].template cast<double>(),
                   model_.vertices[v[1]].template cast<double>(),
                   model_.vertices[v[2]].template cast<double>(), hit) &&
        hit.t >= 0)
      setEnd(found(tree_.triangle(place), hit));
  }

  static constexpr double kDouble = 1. / (1ull << 48), kError = 96. / (1 << 24), kFar = 1e30;

  const fcl::BVHModel<BV>& model_;
  const WideTree<S>& tree_;
  OpenNodes open_;
  Float4 inverse_[3], enter_[3], leave_[3];
  bool is_backward_[3] = {};
  double start_ = 0, per_t_ = 1;
  float end_ = 0;
};

}  // namespace adaptive_bvh
