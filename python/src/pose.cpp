#include "pose.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "arrays.h"

namespace adaptive_bvh::python {
namespace {

constexpr double kLargestError = 1e-6;      // of a rotation that is accepted
constexpr double kLargestRounding = 1e-12;  // of one that is taken as it is
constexpr double kFarthest = 0x1p252;       // a translation

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

Matrix matrixFrom(const py::object& object, Eigen::Index rows, Eigen::Index columns,
                  const std::string& name) {
  const py::array array = numbersFrom(object, name.c_str());
  const Contiguous<double> numbers(array);
  const bool is_column = numbers.ndim() == 1;
  if (numbers.ndim() != 2 && !is_column)
    throw py::value_error(name + " has the shape " + shapeOf(array) +
                          "; (4, 4), or a pair of shapes (3, 3) and (3,), is needed");
  const Eigen::Index height = numbers.shape(0), width = is_column ? 1 : numbers.shape(1);
  if (height != rows || width != columns)
    throw py::value_error(name + " has " + std::to_string(height) + " x " + std::to_string(width) +
                          " numbers; " + std::to_string(rows) + " x " + std::to_string(columns) +
                          " are needed");
  return Eigen::Map<const Matrix>(numbers.data(), height, width);
}

/// The rotation nearest to one that is off by 1e-6 at most: each step squares the error.
fcl::Matrix3d nearestRotation(fcl::Matrix3d r) {
  for (int i = 0; i < 2; ++i) r = 1.5 * r - 0.5 * (r * r.transpose() * r);
  return r;
}

/// How far R R^T is from the identity: at most kLargestError.
double errorOf(const fcl::Matrix3d& rotation, const std::string& name) {
  const double error =
      (rotation * rotation.transpose() - fcl::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kLargestError))
    throw py::value_error(name +
                          ": the rotation is not orthonormal: R R^T differs from the "
                          "identity by " +
                          std::to_string(error) + ", more than 1e-6");
  if (rotation.determinant() < 0)
    throw py::value_error(name + ": the rotation mirrors: its determinant is -1");
  return error;
}

/// A query may take less than a microsecond; the name is short, and allocates nothing.
fcl::Transform3d poseOf(Eigen::Map<const Matrix4> numbers, const std::string& name) {
  if (!numbers.allFinite()) throw py::value_error(name + " has numbers that are not finite");
  if (numbers.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw py::value_error(name + ": the last row is not (0, 0, 0, 1)");
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  pose.linear() = numbers.topLeftCorner<3, 3>();
  pose.translation() = numbers.topRightCorner<3, 1>();
  if (errorOf(pose.linear(), name) > kLargestRounding)
    pose.linear() = nearestRotation(pose.linear());
  if (pose.translation().cwiseAbs().maxCoeff() > kFarthest)
    throw std::invalid_argument("a pose moves a mesh too far away");
  return pose;
}

/// The numbers of a 4 x 4 array that can be read as they lie; null of other objects.
const double* usualNumbers(const py::object& object) {
  using Usual = py::array_t<double, int(py::array::c_style)>;
  if (!Usual::check_(object)) return nullptr;
  const auto array = py::reinterpret_borrow<Usual>(object);
  constexpr int kAligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;
  const bool is_usual = array.ndim() == 2 && array.shape(0) == 4 && array.shape(1) == 4 &&
                        (array.flags() & kAligned) != 0;
  return is_usual ? array.data() : nullptr;
}

bool isPair(const py::object& object) {
  return (py::isinstance<py::tuple>(object) || py::isinstance<py::list>(object)) &&
         py::len(object) == 2;
}

}  // namespace

fcl::Transform3d poseFrom(const py::object& object, const char* name) {
  if (object.is_none()) return fcl::Transform3d::Identity();
  const std::string prefix(name);
  using Usual = Eigen::Map<const Matrix4>;
  if (const double* numbers = usualNumbers(object)) return poseOf(Usual(numbers), prefix);
  Matrix4 pose = Matrix4::Identity();
  if (isPair(object)) {
    const py::sequence pair(object);
    pose.topLeftCorner<3, 3>() = matrixFrom(pair[0], 3, 3, prefix + "[0]");
    pose.topRightCorner<3, 1>() = matrixFrom(pair[1], 3, 1, prefix + "[1]");
  } else {
    pose = matrixFrom(object, 4, 4, prefix);
  }
  return poseOf(Usual(pose.data()), prefix);
}

}  // namespace adaptive_bvh::python
