#pragma once

#include <limits>

#include <fcl/geometry/shape/utility.h>

#include "query/fcl/shape_visitor.h"

namespace adaptive_bvh {

/// What encloses a shape: a box and all that is at most a radius away from it. Of a sphere, a
/// capsule, a box, a plane and a half-space it is the shape itself.
struct ShapeCore {
  /// Takes the coordinates of the box to those of the shape.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  fcl::Vector3d low, high;  ///< infinite where the shape is
  double radius = 0;
};

/// The box of its points.
template <typename Shape, typename S = typename Shape::S>
ShapeCore coreOf(const Shape& shape) {
  fcl::AABB<S> box;
  fcl::computeBV(shape, fcl::Transform3<S>(fcl::Transform3<S>::Identity()), box);
  ShapeCore core;
  core.low = box.min_.template cast<double>();
  core.high = box.max_.template cast<double>();
  return core;
}
template <typename S>
ShapeCore coreOf(const fcl::Sphere<S>& sphere) {
  ShapeCore core;
  core.low = core.high = fcl::Vector3d::Zero();
  core.radius = static_cast<double>(sphere.radius);
  return core;
}
template <typename S>
ShapeCore coreOf(const fcl::Capsule<S>& capsule) {
  ShapeCore core;
  core.high = fcl::Vector3d(0, 0, static_cast<double>(capsule.lz) / 2);
  core.low = -core.high;
  core.radius = static_cast<double>(capsule.radius);
  return core;
}

/// All x with least <= n x <= most.
inline ShapeCore coreOfSlab(const fcl::Vector3d& n, double least, double most) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double length = n.norm();
  ShapeCore core;
  core.axes = Eigen::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitX(), n).toRotationMatrix();
  core.low = fcl::Vector3d(least / length, -kInfinity, -kInfinity);
  core.high = fcl::Vector3d(most / length, kInfinity, kInfinity);
  return core;
}
template <typename S>
ShapeCore coreOf(const fcl::Plane<S>& plane) {
  return coreOfSlab(plane.n.template cast<double>(), double(plane.d), double(plane.d));
}
template <typename S>
ShapeCore coreOf(const fcl::Halfspace<S>& half) {
  return coreOfSlab(half.n.template cast<double>(), -std::numeric_limits<double>::infinity(),
                    double(half.d));
}

}  // namespace adaptive_bvh
