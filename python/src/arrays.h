#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <fcl/math/triangle.h>
#include <Eigen/Core>

// NumPy arrays as arguments and as results. Arguments are read in place where that is possible;
// results own their memory. All functions need the GIL.
namespace adaptive_bvh::python {

namespace py = pybind11;

/// An N x 3 array whose numbers the library can read as they lie: S, C-contiguous, aligned.
template <typename S>
using Rows = py::array_t<S, int(py::array::c_style) | int(py::array::forcecast) |
                                int(py::detail::npy_api::NPY_ARRAY_ALIGNED_)>;

/// The vertices that the rows hold.
template <typename S>
const Eigen::Matrix<S, 3, 1>* pointsOf(const Rows<S>& rows) {
  return reinterpret_cast<const Eigen::Matrix<S, 3, 1>*>(rows.data());
}

/// "(4, 3)", as NumPy writes a shape.
std::string shapeOf(const py::array& array);

/// What NumPy makes of an object; itself if it is an array, and in place where the object offers
/// the buffer protocol, NumPy's interface or DLPack. Throws py::type_error if it is not made of
/// real numbers or lies on a device. `name` stands in the sentence, here and below.
py::array numbersFrom(const py::object& object, const char* name);

/// The object as N x 3 numbers of type S: itself where it is such an array, else converted once.
/// Throws py::type_error, and py::value_error on another shape.
template <typename S>
Rows<S> rowsFrom(const py::object& object, const char* name);

/// N x 3 numbers of type S as matrices of Eigen's, read in place where the numbers of a row or of a
/// column lie side by side: float arrays in C or in Fortran order, and slices of these; else
/// converted once. Throws like `rowsFrom`.
template <typename S>
class StridedRows {
 public:
  template <int kOrder>
  using Matrix = Eigen::Map<const Eigen::Matrix<S, Eigen::Dynamic, 3, kOrder>, Eigen::Unaligned,
                            Eigen::OuterStride<>>;

  StridedRows(const py::object& object, const char* name);

  const py::array& array() const { return array_; }
  /// Which of the two matrices may be asked for.
  bool isRowMajor() const { return is_row_major_; }
  Matrix<Eigen::RowMajor> rowMajor() const { return matrix<Eigen::RowMajor>(); }
  Matrix<Eigen::ColMajor> columnMajor() const { return matrix<Eigen::ColMajor>(); }

 private:
  template <int kOrder>
  Matrix<kOrder> matrix() const {
    return Matrix<kOrder>(static_cast<const S*>(array_.data()), array_.shape(0), 3,
                          Eigen::OuterStride<>(outer_));
  }

  py::array array_;
  bool is_row_major_;
  Eigen::Index outer_;  ///< numbers from one row to the next, or from one column
};

/// The three numbers of one point. Throws as rowsFrom.
template <typename S>
Eigen::Matrix<S, 3, 1> pointFrom(const py::object& object, const char* name);

/// Throws py::value_error when there are not `count` rows, one for each vertex of a mesh.
void requireRows(const py::array& rows, std::size_t count, const char* name);

/// Integers in one row, each at least 0 and less than `limit`, which counts `things`. Throws
/// py::type_error, py::value_error on another shape, py::index_error.
std::vector<unsigned> indicesFrom(const py::object& object, std::size_t limit, const char* name,
                                  const char* things);

/// M x 3 integers. The numbers are at least 0 and less than `vertices`. Throws like `indicesFrom`.
std::vector<fcl::Triangle> trianglesFrom(const py::object& object, std::size_t vertices);

/// M x 2 integers. The first of a pair is less than `first`, the second than `second`. Throws like
/// `indicesFrom`.
template <typename Pair>
std::vector<Pair> pairsFrom(const py::object& object, std::size_t first, std::size_t second,
                            const char* name);

/// K x 2 integers that come from and go to vectors of pairs; int64 inside.
using Integers = Rows<std::int64_t>;
/// The object as integers of two dimensions, with `columns` of them. Throws py::type_error and
/// py::value_error.
Integers integersFrom(const py::object& object, py::ssize_t columns, const char* name);
/// Throws py::index_error when a number is negative or not less than `limit`.
void requireIndex(std::int64_t index, std::size_t limit, const char* name, py::ssize_t row,
                  const char* things);

/// An array that takes over a vector: its elements are seen as numbers of type T.
template <typename T, typename Element>
py::array_t<T> adopt(std::vector<Element>&& elements, std::vector<py::ssize_t> shape) {
  static_assert(sizeof(Element) % sizeof(T) == 0, "an element is made of numbers");
  auto owned = std::make_unique<std::vector<Element>>(std::move(elements));
  const T* numbers = reinterpret_cast<const T*>(owned->data());
  py::capsule owner(owned.get(), [](void* p) { delete static_cast<std::vector<Element>*>(p); });
  owned.release();
  return py::array_t<T>(std::move(shape), numbers, owner);
}

/// As above, of elements that are made of S, as float64.
template <typename S, typename Element>
py::array_t<double> adoptDoubles(std::vector<Element>&& elements, std::vector<py::ssize_t> shape) {
  if constexpr (std::is_same_v<S, double>) {
    return adopt<double>(std::move(elements), std::move(shape));
  } else {
    const S* numbers = reinterpret_cast<const S*>(elements.data());
    std::vector<double> doubles(numbers, numbers + elements.size() * (sizeof(Element) / sizeof(S)));
    return adopt<double>(std::move(doubles), std::move(shape));
  }
}

template <typename Pair>
std::vector<Pair> pairsFrom(const py::object& object, std::size_t first, std::size_t second,
                            const char* name) {
  const Integers numbers = integersFrom(object, 2, name);
  const auto at = numbers.unchecked<2>();
  std::vector<Pair> pairs;
  pairs.reserve(static_cast<std::size_t>(at.shape(0)));
  for (py::ssize_t i = 0; i < at.shape(0); ++i) {
    requireIndex(at(i, 0), first, name, i, "first features");
    requireIndex(at(i, 1), second, name, i, "second features");
    pairs.push_back({static_cast<unsigned>(at(i, 0)), static_cast<unsigned>(at(i, 1))});
  }
  return pairs;
}

}  // namespace adaptive_bvh::python
