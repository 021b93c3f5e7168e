#pragma once

#include <algorithm>
#include <cmath>

#include "adaptive_bvh/penetration.h"
#include "base/rigid.h"
#include "query/depth/depth_search.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// The tolerance of a signed distance, adjusted for rounding: docs/bounds.md, 19.
class DepthPrecision {
 public:
  /// `size`: upper bound of the coordinates of both bodies, in the frame of either.
  DepthPrecision(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2, double size,
                 double tolerance)
      : size_(size),
        error_(size * (0x1p-42 + 1.5 * std::max(defectOf(tf1), defectOf(tf2)))),
        tolerance_(std::max({tolerance, 4 * error_, size * 0x1p-30})) {}

  double size() const { return size_; }
  /// Error of a computed depth or distance.
  double error() const { return error_; }
  /// Tolerance of the search: that of the result, as adjusted, less twice the error.
  double tolerance() const { return tolerance_ - 2 * error_; }

 private:
  /// How far a rotation is from orthonormal.
  static double defectOf(const fcl::Transform3d& tf) {
    const fcl::Matrix3d R = tf.linear();
    return (R.transpose() * R - fcl::Matrix3d::Identity()).norm();
  }

  double size_, error_, tolerance_;
};

/// Builds the result of signedDistance for two placed bodies, in the world frame.
class SignedDistanceResult {
 public:
  SignedDistanceResult(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2,
                       const DepthPrecision& precision)
      : tf1_(tf1), tf2_(tf2), precision_(precision) {}

  /// Result for bodies that are apart. The points are in the frame of the first body if
  /// `is_in_first`, else of the second; `outward` is the normal of the second surface there.
  SignedDistance apart(const TriangleGap& gap, bool is_in_first,
                       const fcl::Vector3d& outward) const {
    SignedDistance result = touching(gap, is_in_first, outward, 0);
    setBounds(gap.distance, gap.distance, result);
    result.lower = std::max(result.lower, 0.);
    return result;
  }
  /// Result for bodies that touch, without a point inside. Their depth is at most `depth`.
  SignedDistance touching(const TriangleGap& gap, bool is_in_first, const fcl::Vector3d& outward,
                          double depth) const {
    const auto& tf = is_in_first ? tf1_ : tf2_;
    SignedDistance result;
    result.deep_body = DeepBody::None;
    setPoints(tf * gap.points.first, tf * gap.points.second, 1, tf.linear() * -outward, result);
    setBounds(-depth, 0, result);
    result.upper = 0;
    result.searches = 0;
    return result;
  }
  /// Result for bodies of which one has a point inside the other. Each bound is in the frame of the
  /// body that contains the point; if both have a point, the second body's is deeper.
  SignedDistance inside(const DepthBounds& first_in_second,
                        const DepthBounds& second_in_first) const {
    SignedDistance result;
    if (second_in_first.is_found) {
      const DepthBounds& deepest = second_in_first;
      result.deep_body = DeepBody::Second;
      setPoints(tf1_ * deepest.nearest, tf1_ * deepest.x, -1, tf1_.linear() * deepest.outward,
                result);
    } else {
      const DepthBounds& deepest = first_in_second;
      result.deep_body = DeepBody::First;
      setPoints(tf2_ * deepest.x, tf2_ * deepest.nearest, -1, tf2_.linear() * -deepest.outward,
                result);
    }
    setBounds(-std::max(first_in_second.upper, second_in_first.upper),
              -std::max(first_in_second.lower, second_in_first.lower), result);
    result.upper = std::min(result.upper, 0.);
    return result;
  }

 private:
  /// Sets the points and the normal, along the line between them. `sign`: 1 if that line leads from
  /// the first body to the second, else -1. `fallback`: the normal if the points are too close.
  void setPoints(const fcl::Vector3d& first, const fcl::Vector3d& second, double sign,
                 const fcl::Vector3d& fallback, SignedDistance& result) const {
    constexpr double kShort = 1e-8;  // of the size: the direction is rounding only
    result.points = {first, second};
    fcl::Vector3d normal = sign * (second - first);
    if (!(normal.norm() > kShort * precision_.size())) normal = fallback;
    if (normal.isZero(0)) normal = fcl::Vector3d::UnitZ();
    result.normal = normal.stableNormalized();
  }
  /// Widens the bounds by the error.
  void setBounds(double lower, double upper, SignedDistance& result) const {
    result.lower = lower - precision_.error();
    result.upper = upper + precision_.error();
  }

  const fcl::Transform3d tf1_, tf2_;
  const DepthPrecision& precision_;
};

}  // namespace adaptive_bvh
