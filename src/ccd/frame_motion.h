#pragma once

#include "adaptive_bvh/motion_clearance.h"

namespace adaptive_bvh {

/// The map from a frame to the world at one time.
struct FrameAt {
  fcl::Matrix3d linear;
  fcl::Vector3d translation;

  /// By components, because Eigen's product is a call for each point.
  fcl::Vector3d operator()(const fcl::Vector3d& x) const {
    const auto component = [&](int k) -> double {
      return linear(k, 0) * x[0] + linear(k, 1) * x[1] + linear(k, 2) * x[2] + translation[k];
    };
    return {component(0), component(1), component(2)};
  }
};

/// A transform whose matrix is a rotation up to rounding, nearly that of `tf`.
fcl::Transform3d rotated(const fcl::Transform3d& tf);

/// The motion of a frame in the world from t = 0 to 1 (FramePath). On a screw a point x turns about
/// an axis by t * angle, and moves along it.
class FrameMotion {
 public:
  FrameMotion(const fcl::Transform3d& from, const fcl::Transform3d& to, FramePath path);

  FrameAt at(double t) const;
  /// Whether the frame turns on a screw: its points then move on arcs.
  bool isScrew() const { return angle_ > 0; }
  /// Whether the frame stays rigid: a screw, or no turn at all.
  bool isRigid() const { return is_rigid_; }
  /// The angle of the screw, from 0 to pi; 0 on a straight path.
  double angle() const { return angle_; }
  /// Upper bound of `angle` times the distance of a point in the world from the axis.
  double angleTimesArm(const fcl::Vector3d& x) const;
  /// Upper bound of the second derivative, by t, of a point that is at `x` in the world at t = 0,
  /// or at most `radius` away from there, and moves in the frame at most at `speed`.
  double acceleration(const fcl::Vector3d& x, double radius, double speed) const;
  /// Upper bound of the frame's translations.
  double reach() const { return reach_; }

 private:
  fcl::Vector3d from_, to_;  ///< translations
  fcl::Matrix3d from_linear_, to_linear_;
  bool is_rigid_;
  double angle_ = 0, reach_;
  fcl::Vector3d axis_ = fcl::Vector3d::UnitX();  ///< of the screw
  double advance_ = 0;                           ///< along the axis
  /// The part of the translation across the axis, and its product with the axis.
  fcl::Vector3d across_ = fcl::Vector3d::Zero(), turned_ = fcl::Vector3d::Zero();
};

}  // namespace adaptive_bvh
