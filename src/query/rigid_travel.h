#pragma once

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/RSS.h>

#include "volume/rounding.h"

namespace adaptive_bvh {

/// How far the second model's placement, seen from the first, has moved its points, summed over
/// calls. Bounds the motion of every point of the second model that is due to the transforms.
template <typename S>
class RigidTravel {
 public:
  /// Let p be where a vertex is now and X, X' the relative transforms before and now. |X' p - X p|
  /// <= |(R' - R) c + T' - T| + |R' - R| |p - c|, c the centre of its local AABB. The Frobenius
  /// norm bounds the spectral one.
  void moveTo(const fcl::Transform3<S>& tf1, const fcl::BVHModel<fcl::RSS<S>>& second,
              const fcl::Transform3<S>& tf2) {
    const auto inverse = tf1.inverse(Eigen::Isometry).template cast<double>();
    const Eigen::Isometry3d now =
        Eigen::Isometry3d((inverse * tf2.template cast<double>()).matrix());
    const fcl::Vector3d center = second.aabb_center.template cast<double>();
    const Eigen::Matrix3d turn = now.linear() - last_.linear();
    const double step = (turn * center + now.translation() - last_.translation()).norm() +
                        turn.norm() * static_cast<double>(second.aabb_radius);
    // The relative transform is off by a few epsilon of what it is made of.
    const double size = tf1.translation().template lpNorm<1>() +
                        tf2.translation().template lpNorm<1>() + center.lpNorm<1>() +
                        static_cast<double>(second.aabb_radius);
    if (step > 0)
      sum_ += step * (1 + 1e-9) + 32 * static_cast<double>(rounding::epsilon<S>()) * size;
    last_ = now;
  }
  double sum() const { return sum_; }

 private:
  Eigen::Isometry3d last_ = Eigen::Isometry3d::Identity();
  double sum_ = 0;
};

}  // namespace adaptive_bvh
