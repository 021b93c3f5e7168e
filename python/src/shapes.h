#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include <fcl/geometry/collision_geometry.h>
#include <Eigen/Core>

#include "bound.h"

namespace adaptive_bvh::python {

/// A primitive of FCL, a plane, a half-space or a convex hull. Does not change, so threads may
/// share it.
class Shape : public Bound {
 public:
  virtual ~Shape() = default;
  Shape(Shape&&) = default;

  /// `sizes` are the arguments of FCL's constructor. Throws py::value_error when one is not between
  /// 1e-8 and 1e8.
  template <template <typename> class Primitive, typename... Sizes>
  static Shape make(const char* name, Sizes... sizes) {
    Shape shape(name, {sizes...});
    shape.geometry_ = std::make_shared<Primitive<double>>(sizes...);
    return shape;
  }

  /// A fcl::Plane or fcl::Halfspace. Throws py::value_error when the normal's length is not 1 to
  /// 1e-6 or the offset is beyond 1e8.
  template <template <typename> class Unbounded>
  static Shape makeUnbounded(const char* name, const Eigen::Vector3d& normal, double offset) {
    const Eigen::Vector3d unit = unitNormal(name, normal, offset);
    Shape shape(name, {});
    shape.sizes_ = {unit[0], unit[1], unit[2], offset};
    shape.geometry_ = std::make_shared<Unbounded<double>>(unit, offset);
    return shape;
  }

  /// FCL's object.
  const fcl::CollisionGeometryd& geometry() const { return *geometry_; }
  std::shared_ptr<const fcl::CollisionGeometryd> geometryPointer() const { return geometry_; }

  double size(std::size_t i) const { return sizes_[i]; }
  /// What Python's constructor takes.
  virtual py::tuple arguments() const;
  /// As in Python: Box(1.0, 2.0, 3.0).
  virtual std::string text() const;

 protected:
  Shape(const char* name, std::vector<double> sizes);
  /// One that Python describes in another way.
  explicit Shape(std::shared_ptr<const fcl::CollisionGeometryd> geometry)
      : geometry_(std::move(geometry)) {}

 private:
  static Eigen::Vector3d unitNormal(const std::string& name, const Eigen::Vector3d& normal,
                                    double offset);

  std::string name_;
  std::vector<double> sizes_;  ///< or a normal and an offset
  std::shared_ptr<const fcl::CollisionGeometryd> geometry_;
};

}  // namespace adaptive_bvh::python
