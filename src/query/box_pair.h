#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/frame_change.h"
#include "tree/box_tree.h"

namespace adaptive_bvh {

/// The relative placement of two box trees. The gap of two boxes is computed in the frame of either
/// tree: the box of one is enclosed by a box in the other's frame. A flat box is thin in its own
/// frame whatever the angle, so the larger of both gaps is a good bound.
///
/// A computed gap, in units of the first tree, exceeds the distance of what the boxes hold by at
/// most `error_`: docs/bounds.md, 4. Gaps in the second frame are scaled to the first's units.
class BoxPair {
 public:
  template <typename S>
  BoxPair(const BoxTree<S>& first, const fcl::Transform3<S>& tf1, const BoxTree<S>& second,
          const fcl::Transform3<S>& tf2) {
    const auto axesOf = [](const BoxTree<S>& boxes, const fcl::Transform3<S>& tf) {
      return fcl::Matrix3d(tf.linear().template cast<double>() * boxes.frame.axes());
    };
    const auto fromTranslation = [](const BoxTree<S>& boxes, const fcl::Transform3<S>& tf) {
      return fcl::Vector3d(tf.linear().template cast<double>() *
                           boxes.frame.origin().template cast<double>());
    };
    const fcl::Matrix3d to_first = axesOf(first, tf1).transpose();
    const fcl::Matrix3d turn = to_first * axesOf(second, tf2);
    // The translations' difference first: bodies may be near each other and both far away.
    const fcl::Vector3d between =
        (tf2.translation().template cast<double>() - tf1.translation().template cast<double>()) +
        (fromTranslation(second, tf2) - fromTranslation(first, tf1));
    const double scale1 = static_cast<double>(first.frame.scale());
    const double scale2 = static_cast<double>(second.frame.scale());
    const double ratio = scale1 / scale2;
    const fcl::Vector3d t = scale1 * (to_first * between);
    to_first_ = FrameChange(ratio * turn, t);
    to_second_ = FrameChange(turn.transpose() / ratio, -(turn.transpose() * t) / ratio);
    is_aligned_ = turn.cwiseAbs().rowwise().sum().maxCoeff() < kAligned;
    scale_ = scale1;
    ratio_ = static_cast<float>(ratio);
    ratio2_ = ratio_ * ratio_;
    const double extent1 = first.root().largestCoordinate(),
                 extent2 = 3 * ratio * second.root().largestCoordinate();
    constexpr double kOperations = 1. / (1 << 20);
    error_ = 2 * (kOperations * (extent1 + extent2 + t.lpNorm<1>()) +
                  BodyFrame<S>::kError * (extent1 + extent2));
  }

  /// Whether the gaps in the second frame are hardly ever larger: boxes do not grow when they are
  /// turned to the other frame, whose axes are nearly these.
  bool isAligned() const { return is_aligned_; }

  bool isPrecise() const { return error_ < 1e12 && ratio_ > 1e-6f && ratio_ < 1e6f; }

  const FrameChange& toFirst() const { return to_first_; }
  const FrameChange& toSecond() const { return to_second_; }
  /// Makes squared gaps in the first frame the larger ones of both; `a` is given in the second.
  ADAPTIVE_BVH_INLINE void raiseBySecond(const Boxes4& a, const Boxes4& b, Gaps4x4& gaps) const {
    const Gaps4x4 second = squaredGaps(a, b);
    for (int j = 0; j < 4; ++j)
      gaps.row[j] = float4::upper<Float4>(gaps.row[j], second.row[j] * float4::all(ratio2_));
  }
  float ratio() const { return ratio_; }

  /// By so much boxes may be nearer to each other, along any direction, than what they hold.
  double error() const { return error_ / scale_; }

  /// Two nodes whose squared gap is at least this are at least `distance` apart.
  template <typename S>
  float squaredGapFor(S distance) const {
    const double gap = static_cast<double>(distance) * scale_ * (1 + 1. / (1 << 20)) + error_;
    return static_cast<float>(std::min(gap * gap, 1e300) * (1 + 1. / (1 << 20)));
  }
  /// Nodes with a smaller squared gap are nearer than `distance`, or their boxes are loose: a gap
  /// that is larger by the boxes' error could not be that of boxes so near.
  template <typename S>
  float squaredGapNear(S distance) const {
    const double gap =
        std::max(0., static_cast<double>(distance) * scale_ * (1 - 1. / (1 << 20)) - error_);
    return static_cast<float>(std::min(gap * gap, 1e300) * (1 - 1. / (1 << 20)));
  }
  /// Two nodes with this squared gap are at least so far apart; not negative.
  double distanceFor(float squared_gap) const {
    return std::max(
        0., (std::sqrt(static_cast<double>(squared_gap)) * (1 - 1. / (1 << 20)) - error_) / scale_);
  }

 private:
  FrameChange to_first_, to_second_;
  static constexpr double kAligned = 1 + 1. / 32;
  double scale_, error_;
  float ratio_, ratio2_;
  bool is_aligned_;
};

}  // namespace adaptive_bvh
