#pragma once

#include <limits>

#include <fcl/common/types.h>

#include "base/rigid.h"
#include "query/contacts.h"
#include "triangles/triangle_shape.h"

namespace adaptive_bvh {

/// What encloses a shape: a box and all that is at most a radius away from it. Of a sphere, a
/// capsule, a box, a plane and a half-space it is the shape itself.
struct ShapeCore {
  /// Takes the coordinates of the box to those of the shape.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  fcl::Vector3d low, high;  ///< infinite where the shape is
  double radius = 0;

  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

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

/// The triangles of an object of a query, as a shape sees them.
template <typename S>
class ShapeTriangles {
 public:
  ShapeTriangles(const PlacedTriangles<S>& triangles, int count, const TriangleShape& shape,
                 const fcl::Transform3<S>& shape_tf)
      : triangles_(triangles),
        count_(count),
        shape_(shape),
        shape_tf_(shape_tf),
        to_shape_(shape_tf, triangles.tf) {}

  const PlacedTriangles<S>& placed() const { return triangles_; }
  int count() const { return count_; }
  /// In the shape's frame.
  TrianglePoints<double> corners(int triangle) const {
    const TrianglePoints<S> points = triangles_[triangle];
    return {to_shape_(points[0]), to_shape_(points[1]), to_shape_(points[2])};
  }
  TriangleGap gap(int triangle) const { return shape_.gap(corners(triangle)); }
  bool touches(int triangle, ShapeContact& contact) const {
    return shape_.touches(corners(triangle), contact);
  }
  fcl::Vector3<S> inWorld(const fcl::Vector3d& x) const {
    return (shape_tf_.template cast<double>() * x).template cast<S>();
  }
  fcl::Vector3<S> turnedToWorld(const fcl::Vector3d& direction) const {
    return (shape_tf_.linear().template cast<double>() * direction).template cast<S>();
  }

 private:
  const PlacedTriangles<S> triangles_;
  const int count_;
  const TriangleShape& shape_;
  const fcl::Transform3<S> shape_tf_;
  const RelativePlacement to_shape_;
};

}  // namespace adaptive_bvh
