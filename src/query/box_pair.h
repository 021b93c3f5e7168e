#pragma once

#include <algorithm>
#include <cmath>

#include "tree/box_tree.h"

namespace adaptive_bvh {

/// A box as its middle and half its sides.
struct CenteredBox {
  Float4 center, half;

  explicit CenteredBox(const Box& box) : center(box.center()), half(box.halfSides()) {}
  CenteredBox(const Float4& c, const Float4& h) : center(c), half(h) {}
};

/// The squared distance of two boxes of one frame.
inline float squaredGap(const CenteredBox& a, const CenteredBox& b) {
  const Float4 gap =
      float4::upper(float4::absolute(a.center - b.center) - (a.half + b.half), float4::all(0));
  return float4::sum(gap * gap);
}

/// A change of frame: y' = M y + t, M a rotation times a scale.
class FrameChange {
 public:
  FrameChange() = default;
  FrameChange(const fcl::Matrix3d& m, const fcl::Vector3d& t) {
    for (int k = 0; k < 3; ++k) {
      columns_[k] = Float4{float(m(0, k)), float(m(1, k)), float(m(2, k)), 0};
      sizes_[k] = float4::absolute(columns_[k]);
    }
    t_ = Float4{float(t[0]), float(t[1]), float(t[2]), 0};
  }

  /// The box around the box in the new frame.
  CenteredBox operator()(const CenteredBox& box) const {
    using float4::broadcast;
    return {columns_[0] * broadcast<0>(box.center) + columns_[1] * broadcast<1>(box.center) +
                columns_[2] * broadcast<2>(box.center) + t_,
            sizes_[0] * broadcast<0>(box.half) + sizes_[1] * broadcast<1>(box.half) +
                sizes_[2] * broadcast<2>(box.half)};
  }

 private:
  Float4 columns_[3], sizes_[3], t_;
};

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
    scale_ = scale1;
    ratio_ = static_cast<float>(ratio);
    ratio2_ = ratio_ * ratio_;
    const double extent1 = first.root().largestCoordinate(),
                 extent2 = 3 * ratio * second.root().largestCoordinate();
    constexpr double kOperations = 1. / (1 << 20);
    error_ = 2 * (kOperations * (extent1 + extent2 + t.lpNorm<1>()) +
                  BodyFrame<S>::kError * (extent1 + extent2));
  }

  bool isPrecise() const { return error_ < 1e12 && ratio_ > 1e-6f && ratio_ < 1e6f; }

  const FrameChange& toFirst() const { return to_first_; }
  const FrameChange& toSecond() const { return to_second_; }
  /// The larger squared gap of both frames; only the first one's when that is `enough`. The second
  /// model's box `b` is given in the first's frame as well.
  float gapFromFirst(const CenteredBox& a, const CenteredBox& b, const CenteredBox& b_in_first,
                     float enough) const {
    const float gap = squaredGap(a, b_in_first);
    return gap < enough ? std::max(gap, ratio2_ * squaredGap(to_second_(a), b)) : gap;
  }
  /// As gapFromFirst, but computes the gap in the second frame first; the first model's box `a` is
  /// given there as well.
  float gapFromSecond(const CenteredBox& a, const CenteredBox& b, const CenteredBox& a_in_second,
                      float enough) const {
    const float gap = ratio2_ * squaredGap(a_in_second, b);
    return gap < enough ? std::max(gap, squaredGap(a, to_first_(b))) : gap;
  }
  float ratio() const { return ratio_; }

  /// Two nodes whose squared gap is at least this are at least `distance` apart.
  template <typename S>
  float squaredGapFor(S distance) const {
    const double gap = static_cast<double>(distance) * scale_ * (1 + 1. / (1 << 20)) + error_;
    return static_cast<float>(std::min(gap * gap, 1e300) * (1 + 1. / (1 << 20)));
  }
  /// Two nodes with this squared gap are at least so far apart; not negative.
  double distanceFor(float squared_gap) const {
    return std::max(
        0., (std::sqrt(static_cast<double>(squared_gap)) * (1 - 1. / (1 << 20)) - error_) / scale_);
  }

 private:
  FrameChange to_first_, to_second_;
  double scale_, error_;
  float ratio_, ratio2_;
};

}  // namespace adaptive_bvh
