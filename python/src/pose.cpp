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

Matrix matrixFrom(const py::object& object, const std::string& name) {
  const py::array array = numbersFrom(object, name.c_str());
  const Contiguous<double> numbers(array);
  const bool is_column = numbers.ndim() == 1;
  if (numbers.ndim() != 2 && !is_column)
    throw py::value_error(name + " has the shape " + shapeOf(array) +
                          "; (4, 4), or a pair of shapes (3, 3) and (3,), is needed");
  return Eigen::Map<const Matrix>(numbers.data(), numbers.shape(0),
                                  is_column ? 1 : numbers.shape(1));
}

void requireShape(const Matrix& matrix, Eigen::Index rows, Eigen::Index columns,
                  const std::string& name) {
  if (matrix.rows() != rows || matrix.cols() != columns)
    throw py::value_error(name + " has " + std::to_string(matrix.rows()) + " x " +
                          std::to_string(matrix.cols()) + " numbers; " + std::to_string(rows) +
                          " x " + std::to_string(columns) + " are needed");
  if (!matrix.allFinite()) throw py::value_error(name + " has numbers that are not finite");
}

/// The rotation nearest to one that is off by 1e-6 at most: each step squares the error.
fcl::Matrix3d nearestRotation(fcl::Matrix3d r) {
  for (int i = 0; i < 2; ++i) r = 1.5 * r - 0.5 * (r * r.transpose() * r);
  return r;
}

fcl::Transform3d poseOf(const fcl::Matrix3d& rotation, const fcl::Vector3d& translation,
                        const char* pose_name) {
  const std::string name(pose_name);  // short: it allocates nothing
  const double error =
      (rotation * rotation.transpose() - fcl::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kLargestError))
    throw py::value_error(name +
                          ": the rotation is not orthonormal: R R^T differs from the "
                          "identity by " +
                          std::to_string(error) + ", more than 1e-6");
  if (rotation.determinant() < 0)
    throw py::value_error(name + ": the rotation mirrors: its determinant is -1");
  if (translation.cwiseAbs().maxCoeff() > kFarthest)
    throw std::invalid_argument("a pose moves a mesh too far away");
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  pose.linear() = error > kLargestRounding ? nearestRotation(rotation) : rotation;
  pose.translation() = translation;
  return pose;
}

/// Of the usual array, without what others need: a query may take less than a microsecond.
fcl::Transform3d poseOf(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> pose,
                        const char* name) {
  if (!pose.allFinite())
    throw py::value_error(std::string(name) + " has numbers that are not finite");
  if (pose.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw py::value_error(std::string(name) + ": the last row is not (0, 0, 0, 1)");
  return poseOf(pose.topLeftCorner<3, 3>(), pose.topRightCorner<3, 1>(), name);
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
  using Usual = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>;
  if (const double* numbers = usualNumbers(object)) return poseOf(Usual(numbers), name);
  const std::string prefix(name);
  if (isPair(object)) {
    const py::sequence pair(object);
    const Matrix rotation = matrixFrom(pair[0], prefix + "[0]"),
                 translation = matrixFrom(pair[1], prefix + "[1]");
    requireShape(rotation, 3, 3, prefix + "[0]");
    requireShape(translation, 3, 1, prefix + "[1]");
    return poseOf(rotation, translation, name);
  }
  const Matrix pose = matrixFrom(object, prefix);
  requireShape(pose, 4, 4, prefix);
  return poseOf(Usual(pose.data()), name);
}

}  // namespace adaptive_bvh::python
