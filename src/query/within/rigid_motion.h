#pragma once

#include <algorithm>

#include "base/rounding.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// The motion of the second of two meshes relative to the first by their transforms, without
/// deformation, summed over calls: an upper bound for each of its points. The sum is rounded up, so
/// that no step is lost. Restarts at 0 if NaN, or too large to add small steps. docs/bounds.md, 7.
class RigidMotion {
 public:
  /// Adds the motion since the last call. Returns false if the sum restarts.
  bool moveTo(const PlacedMesh& first, const PlacedMesh& second) {
    const bool moved = first.tf.matrix() != tf1_.matrix() || second.tf.matrix() != tf2_.matrix();
    if (moved) sum_ = rounding::sum(sum_, step(first.tf, second.tf, second.bounds()));
    tf1_ = first.tf;
    tf2_ = second.tf;
    constexpr double kLargestSum = 1 << 20;  // beyond it, a step costs 2^-31 of the bodies' sizes
    const double size = first.bounds().aabb_radius + second.bounds().aabb_radius;
    if (sum_ <= kLargestSum * size) return true;
    sum_ = 0;
    return false;
  }
  double sum() const { return sum_; }  ///< in the meshes' unit

 private:
  /// Returns an upper bound of the motion of a vertex since the last call. Let p be its position
  /// now, X and X' the relative transforms then and now, and c the centre of the local AABB. Then
  /// |X' p - X p| <= |(R' - R) c + T' - T| + |R' - R| |p - c|. The Frobenius norm bounds the
  /// spectral norm. The last summand covers the rounding of the query's own relative transforms.
  double step(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2,
              const LocalBounds& second) const {
    const Eigen::Isometry3d last = relative(tf1_, tf2_), now = relative(tf1, tf2);
    const fcl::Vector3d center = second.aabb_center;
    const double radius = second.aabb_radius;
    const Eigen::Matrix3d change = now.linear() - last.linear();
    const double motion =
        (change * center + now.translation() - last.translation()).norm() + change.norm() * radius;
    const auto sumOf = [](const fcl::Transform3d& tf) -> double {
      return tf.translation().lpNorm<1>();
    };
    const double size =
        std::max(sumOf(tf1_) + sumOf(tf2_), sumOf(tf1) + sumOf(tf2)) + center.lpNorm<1>() + radius;
    return motion * (1 + 1e-9) + 32 * rounding::epsilon<double>() * size;
  }

  /// Maps the second mesh's frame to the first's.
  static Eigen::Isometry3d relative(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2) {
    const Eigen::Isometry3d a(tf1.matrix());
    return a.inverse(Eigen::Isometry) * Eigen::Isometry3d(tf2.matrix());
  }

  fcl::Transform3d tf1_ = fcl::Transform3d::Identity(), tf2_ = tf1_;  ///< of the last call
  double sum_ = 0;
};

}  // namespace adaptive_bvh
