#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <fcl/common/types.h>
#include <fcl/math/triangle.h>

#include "adaptive_bvh/feature_pairs.h"

// NumPy arrays as arguments, read in place where that is possible. All functions need the GIL.
namespace adaptive_bvh::python {

namespace py = pybind11;

/// An array whose numbers can be read as they lie: C-contiguous, aligned.
template <typename T>
using Contiguous = py::array_t<T, int(py::array::c_style) | int(py::array::forcecast) |
                                      int(py::detail::npy_api::NPY_ARRAY_ALIGNED_)>;

/// "(4, 3)", as NumPy writes a shape.
std::string shapeOf(const py::array& array);

/// What NumPy makes of an object; itself if it is an array, and in place where the object offers
/// the buffer protocol, NumPy's interface or DLPack. Throws py::type_error if it is not made of
/// real numbers or lies on a device. `name` stands in the sentence, here and below.
py::array numbersFrom(const py::object& object, const char* name);

/// An N x 3 array of float64 numbers: the points that its rows are.
class Rows {
 public:
  /// Of the object itself where it is such an array, else converted once. Throws py::type_error,
  /// and py::value_error on another shape.
  Rows(const py::object& object, const char* name);

  std::size_t size() const { return static_cast<std::size_t>(numbers_.shape(0)); }
  const fcl::Vector3d* begin() const {
    return reinterpret_cast<const fcl::Vector3d*>(numbers_.data());
  }
  const fcl::Vector3d* end() const { return begin() + size(); }
  const py::array& array() const { return numbers_; }
  /// One row becomes `count` equal ones; more rows stay as they are.
  void repeat(std::size_t count);

 private:
  Contiguous<double> numbers_;
};

/// N x 3 numbers, float64 or float32, as matrices of Eigen's, read in place where the numbers of a
/// row or of a column lie side by side: arrays in C or in Fortran order, and slices of these; else
/// converted once. Throws like `Rows`.
class StridedRows {
 public:
  template <typename S, int kOrder>
  using Matrix = Eigen::Map<const Eigen::Matrix<S, Eigen::Dynamic, 3, kOrder>, Eigen::Unaligned,
                            Eigen::OuterStride<>>;

  StridedRows(const py::object& object, const char* name);

  const py::array& array() const { return array_; }
  /// Returns `f(matrix)` for the Matrix that the numbers are. Does not need the GIL.
  template <typename F>
  auto visit(const F& f) const {
    return is_double_ ? visitAs<double>(f) : visitAs<float>(f);
  }

 private:
  template <typename S, typename F>
  auto visitAs(const F& f) const {
    return is_row_major_ ? f(matrix<S, Eigen::RowMajor>()) : f(matrix<S, Eigen::ColMajor>());
  }
  template <typename S, int kOrder>
  Matrix<S, kOrder> matrix() const {
    return Matrix<S, kOrder>(static_cast<const S*>(array_.data()), array_.shape(0), 3,
                             Eigen::OuterStride<>(outer_));
  }

  py::array array_;
  bool is_double_, is_row_major_;
  Eigen::Index outer_;  ///< numbers from one row to the next, or from one column
};

/// The three numbers of one point. Throws like `Rows`.
fcl::Vector3d pointFrom(const py::object& object, const char* name);

/// N rays. One origin is that of all directions, and one direction that of all origins. Throws as
/// Rows, and py::value_error when there are not as many directions as origins.
struct RayArguments {
  RayArguments(const py::object& from, const py::object& along);

  Rows origins, directions;
};

/// Throws py::value_error when there are not `count` rows, one for each vertex of a mesh.
void requireRows(const py::array& rows, std::size_t count, const char* name);

/// Integers in one row, each at least 0 and less than `limit`, which counts `things`. Throws
/// py::type_error, py::value_error on another shape, py::index_error.
std::vector<unsigned> indicesFrom(const py::object& object, std::size_t limit, const char* name,
                                  const char* things);

/// M x 3 integers. The numbers are at least 0 and less than `vertices`. Throws like `indicesFrom`.
std::vector<fcl::Triangle> trianglesFrom(const py::object& object, std::size_t vertices);

/// M x 2 integers, each at least 0 and less than 2^31. Throws like `indicesFrom`.
std::vector<FeaturePair> pairsFrom(const py::object& object, const char* name);

/// Throws py::index_error when an index is negative or not less than `limit`.
void requireIndex(std::int64_t index, std::size_t limit, const char* name, std::size_t row,
                  const char* things);

}  // namespace adaptive_bvh::python
