#pragma once

#include <fcl/geometry/collision_geometry.h>

#include "base/rounding.h"

namespace adaptive_bvh {

/// How far the second of two models, seen from the first, has been moved by the two transforms,
/// summed over calls. Bounds the motion of each of its points. The sum is rounded up, so that no
/// step is lost in it, however small. It begins anew when it has become so large that its rounding
/// would cost too much, or when it is not a number.
template <typename S>
class RigidMotion {
 public:
  /// Adds the motion since the last call. False when the sum begins anew: bounds from before are
  /// then useless.
  bool moveTo(const fcl::Transform3<S>& tf1, const fcl::CollisionGeometry<S>& first,
              const fcl::Transform3<S>& tf2, const fcl::CollisionGeometry<S>& second) {
    const bool moved = tf1.matrix() != tf1_.matrix() || tf2.matrix() != tf2_.matrix();
    if (moved) sum_ = rounding::sum(sum_, step(tf1, tf2, second));
    tf1_ = tf1;
    tf2_ = tf2;
    constexpr double kLongWay = 1 << 20;  // then a step costs 2^-31 of the bodies' sizes
    const auto size = static_cast<double>(first.aabb_radius + second.aabb_radius);
    if (sum_ <= kLongWay * size) return true;
    sum_ = 0;
    return false;
  }
  double sum() const { return sum_; }

 private:
  /// Let p be where a vertex is now and X, X' the relative transforms before and now. |X' p - X p|
  /// <= |(R' - R) c + T' - T| + |R' - R| |p - c|, c the centre of its local AABB. The Frobenius
  /// norm bounds the spectral one. The query's own relative transform is off by a few epsilon of
  /// what it is made of, before and now.
  double step(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
              const fcl::CollisionGeometry<S>& second) const {
    const Eigen::Isometry3d last = relative(tf1_, tf2_), now = relative(tf1, tf2);
    const fcl::Vector3d center = second.aabb_center.template cast<double>();
    const auto radius = static_cast<double>(second.aabb_radius);
    const Eigen::Matrix3d turn = now.linear() - last.linear();
    const double way =
        (turn * center + now.translation() - last.translation()).norm() + turn.norm() * radius;
    const auto sumOf = [](const fcl::Transform3<S>& tf) {
      return static_cast<double>(tf.translation().template lpNorm<1>());
    };
    const double size = std::max(sumOf(tf1_) + sumOf(tf2_), sumOf(tf1) + sumOf(tf2)) +
                        center.template lpNorm<1>() + radius;
    return way * (1 + 1e-9) + 32 * static_cast<double>(rounding::epsilon<S>()) * size;
  }

  static Eigen::Isometry3d relative(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2) {
    const Eigen::Isometry3d a(tf1.matrix().template cast<double>());
    return a.inverse(Eigen::Isometry) * Eigen::Isometry3d(tf2.matrix().template cast<double>());
  }

  fcl::Transform3<S> tf1_ = fcl::Transform3<S>::Identity(), tf2_ = tf1_;
  double sum_ = 0;
};

}  // namespace adaptive_bvh
