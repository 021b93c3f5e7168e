// Straight and screw motions of frames.
#include "ccd/frame_motion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Matrix = fcl::Matrix3d;

constexpr double kUp = 1 + 1e-9;  // exceeds the rounding errors of the bounds

/// sin(x) / sin(y) for 0 <= x <= y <= pi / 2; share is x / y.
double ratioOfSines(double x, double y, double share) {
  constexpr double kSmall = 1e-8;  // the square is below the rounding error
  return y < kSmall ? share : std::sin(x) / std::sin(y);
}

}  // namespace

fcl::Transform3d rotated(const fcl::Transform3d& tf) {
  fcl::Transform3d rigid = tf;
  rigid.linear() = Eigen::Quaterniond(Matrix(tf.linear())).normalized().toRotationMatrix();
  return rigid;
}

FrameMotion::FrameMotion(const fcl::Transform3d& from, const fcl::Transform3d& to, FramePath path)
    : from_(from.translation()),
      to_(to.translation()),
      from_linear_(from.linear()),
      to_linear_(to.linear()),
      is_rigid_(from_linear_ == to_linear_),
      reach_((std::max(from_.norm(), to_.norm()) + 2 * (to_ - from_).norm()) * kUp) {
  if (path == FramePath::Straight || is_rigid_) return;
  is_rigid_ = true;
  const Matrix turn = to_linear_ * from_linear_.transpose();
  Eigen::Quaterniond rotation(turn);
  if (rotation.w() < 0) rotation.coeffs() = -rotation.coeffs();
  const double sine = rotation.vec().norm();
  angle_ = 2 * std::atan2(sine, rotation.w());
  if (sine > 0) axis_ = rotation.vec() / sine;
  const Vector moved = to_ - from_;
  advance_ = axis_.dot(moved);
  across_ = moved - advance_ * axis_;
  turned_ = axis_.cross(across_);
}

/// With the angles a = angle / 2 and b = t a, a point that turns from 0 to `across` by 2 a is at
/// sin b (cos(a - b) across - sin(a - b) turned) / sin a after turning by 2 b.
FrameAt FrameMotion::at(double t) const {
  if (!isScrew()) {
    if (t == 0) return {from_linear_, from_};
    if (t == 1) return {to_linear_, to_};
    const Vector translation = (1 - t) * from_ + t * to_;
    if (is_rigid_) return {from_linear_, translation};
    return {(1 - t) * from_linear_ + t * to_linear_, translation};
  }
  const double half = angle_ / 2, part = t * half, rest = half - part;
  const double ratio = ratioOfSines(part, half, t);
  const Vector sine = std::sin(part) * axis_;
  const Eigen::Quaterniond rotation(std::cos(part), sine[0], sine[1], sine[2]);
  return {
      rotation.toRotationMatrix() * from_linear_,
      from_ + t * advance_ * axis_ + ratio * (std::cos(rest) * across_ - std::sin(rest) * turned_)};
}

double FrameMotion::angleTimesArm(const Vector& x) const {
  if (!isScrew()) return 0;
  // The axis passes through from + across / 2 + turned / (2 tan(angle / 2)).
  const double half = angle_ / 2, cotangent = half * std::cos(half) / std::sin(half);
  const Vector from_axis = angle_ * (x - from_ - across_ / 2) - cotangent * turned_;
  return (from_axis - axis_.dot(from_axis) * axis_).norm() * kUp +
         1e-12 * angle_ * (x.norm() + reach_);
}

double FrameMotion::acceleration(const Vector& x, double radius, double speed) const {
  return angle_ * (angleTimesArm(x) + angle_ * radius + 2 * speed) * kUp;
}

}  // namespace adaptive_bvh
