#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/frame_change.h"
#include "geometry/triangle_contact.h"
#include "geometry/triangle_pairs.h"
#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// Coordinates in a tree are below 2: no difference of two triangles side by side is longer.
constexpr double kLongest = 12;

/// The second tree of a pair as the first one sees it, where both are the same, or have the same
/// coordinates.
template <typename S>
class SameFrame {
 public:
  static constexpr bool kIsIdentity = true;

  SameFrame() = default;
  /// `apart`: what the coordinates, and FCL's placement of the second, may be off.
  explicit SameFrame(double apart) : apart_(static_cast<float>(apart)) {}

  float error() const { return WideTree<S>::kPositionError + apart_; }
  /// Of a position and its residual together.
  float preciseError() const { return 2 * WideTree<S>::kResidualError + apart_; }
  static double longest() { return kLongest; }
  const Boxes4& operator()(const Boxes4& boxes) const { return boxes; }
  const Vector4x3& operator()(const Vector4x3& points) const { return points; }

 private:
  float apart_ = 0;
};

/// Takes what is in the second tree's coordinates to the first's: y = M y2 + t. A box becomes the
/// box around it, larger by what the two trees and this computation may be off.
template <typename S>
class RelativeFrame {
 public:
  static constexpr bool kIsIdentity = false;
  /// R and T place the second model in the first's coordinates, in FCL's own rounding.
  RelativeFrame(const WideTree<S>& first, const WideTree<S>& second, const fcl::Matrix3<S>& R,
                const fcl::Vector3<S>& T) {
    const fcl::Matrix3d& turn = R.template cast<double>();
    const fcl::Vector3d& moved = T.template cast<double>();
    const double ratio = first.scale() / second.scale();
    const fcl::Matrix3d m =
        first.toBody() * turn * second.toBody().transpose() / (second.scale() * second.scale());
    const fcl::Vector3d t = first.toBody() * (turn * second.origin() + moved - first.origin());
    // Coordinates in either tree are below 2. FCL computes R x + T in its own numbers.
    in_model_ = 4 * first.scale() *
                (3 * (second.origin().template lpNorm<1>() + 6 / second.scale()) +
                 moved.template lpNorm<1>() + first.origin().template lpNorm<1>()) *
                static_cast<double>(std::numeric_limits<S>::epsilon());
    error_ = kUnit * (6 * 4 * ratio + 4 * t.template lpNorm<1>()) +
             (1 + 2 * ratio) * static_cast<double>(WideTree<S>::kPositionError) + in_model_;
    longest_ = std::max(1., ratio);
    // Sums of three coordinates are below 6.
    apart_ =
        2 * (6 * (m - fcl::Matrix3d::Identity()).cwiseAbs().maxCoeff() + t.cwiseAbs().maxCoeff()) +
        in_model_;
    is_precise_ = error_ < 1e6 && ratio > 1e-6 && ratio < 1e6;
    change_ = FrameChange(m, t, 2 * error_ + 16 * kUnit * (4 * ratio + t.template lpNorm<1>()));
  }

  /// Whether single precision can express both; else FCL's traversal is to answer.
  bool isPrecise() const { return is_precise_; }
  /// Whether both trees have the same coordinates, but for what their boxes have to spare.
  bool isSame() const { return apart_ <= kUnit; }
  SameFrame<S> same() const { return SameFrame<S>(apart_); }
  /// Of a component of a point of either, in the first's body units.
  float error() const { return static_cast<float>(error_); }
  /// Of a component of R x + T, in the model's own numbers.
  float preciseError() const { return static_cast<float>(in_model_); }
  /// At least the largest difference of triangles side by side, in the first's body units.
  double longest() const { return kLongest * longest_; }
  /// As FCL places the points.
  ADAPTIVE_BVH_INLINE static void place(const fcl::Matrix3<S>& R, const fcl::Vector3<S>& T,
                                        TrianglePoints<S>& points) {
    for (fcl::Vector3<S>& x : points) x = R * x + T;
  }

  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const { return change_(boxes); }
  ADAPTIVE_BVH_INLINE Vector4x3 operator()(const Vector4x3& points) const {
    return change_(points);
  }

 private:
  static constexpr double kUnit = 1. / (1 << 24);

  FrameChange change_;
  double error_, in_model_, longest_, apart_;
  bool is_precise_;
};

}  // namespace adaptive_bvh
