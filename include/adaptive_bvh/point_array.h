#pragma once

#include <cstddef>
#include <initializer_list>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/common/types.h>

#include "adaptive_bvh/build_flags.h"

/// \file
/// How calls take points: as a vector or as a matrix.
namespace adaptive_bvh {

namespace detail {

/// Points in memory: component k of point i is data[i * point + k * component].
struct StridedPoints {
  const double* data;
  Eigen::Index count, point, component;
};

/// Throws std::invalid_argument: no matrix of points has this shape.
[[noreturn]] void refusePointMatrix(Eigen::Index rows, Eigen::Index columns);
/// Returns the number of points of two arrays. Throws std::invalid_argument if they differ.
std::size_t commonSize(std::size_t first, std::size_t second);

/// Returns use(StridedPoints) for a matrix with a point a row (N x 3) or a column (3 x N).
/// Matrices and maps in either storage order are read in place, expressions are evaluated first.
template <typename Derived, typename Use>
decltype(auto) withStrided(const Eigen::MatrixBase<Derived>& matrix, const Use& use) {
  static_assert(std::is_same<typename Derived::Scalar, double>::value,
                "adaptive_bvh: points of another number type; pass points.cast<double>()");
  constexpr int kRows = Derived::RowsAtCompileTime, kColumns = Derived::ColsAtCompileTime;
  const bool columns = kRows == 3 && kColumns != 3, rows = kColumns == 3 && kRows != 3;
  const bool is_3xN = columns || (!rows && matrix.rows() == 3 && matrix.cols() != 3);
  const bool is_Nx3 = rows || (!columns && matrix.cols() == 3 && matrix.rows() != 3);
  if (!is_3xN && !is_Nx3) refusePointMatrix(matrix.rows(), matrix.cols());
  const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic,
                                       Derived::IsRowMajor ? Eigen::RowMajor : Eigen::ColMajor>,
                   0, Eigen::OuterStride<>>
      m(matrix.derived());
  const Eigen::Index outer = m.outerStride(), inner = 1;
  const bool outer_is_row = Derived::IsRowMajor;
  const Eigen::Index row = outer_is_row ? outer : inner, column = outer_is_row ? inner : outer;
  return is_Nx3 ? use(StridedPoints{m.data(), m.rows(), row, column})
                : use(StridedPoints{m.data(), m.cols(), column, row});
}

/// Returns the points of a matrix.
template <typename Derived>
std::vector<fcl::Vector3d> pointsOf(const Eigen::MatrixBase<Derived>& matrix) {
  return withStrided(matrix, [](const StridedPoints& from) {
    std::vector<fcl::Vector3d> points(static_cast<std::size_t>(from.count));
    for (std::size_t i = 0; i < points.size(); ++i)
      for (Eigen::Index k = 0; k < 3; ++k)
        points[i][k] = from.data[static_cast<Eigen::Index>(i) * from.point + k * from.component];
    return points;
  });
}

}  // namespace detail

/// The points or directions that a call takes. Converts from what the caller has:
/// - a std::vector of points, which is read where it is; a list of points in braces;
/// - a matrix with a point a row (N x 3) or a column (3 x N), such as an Eigen::MatrixX3d, an
///   Eigen::Map of an array of NumPy, or an expression. It is copied, which allocates.
///
/// Throws std::invalid_argument on matrices of other shapes, and on a 3 x 3 matrix whose type does
/// not state whether rows or columns are the points. For another number type pass
/// points.cast<double>().
class PointArray {
 public:
  using Point = fcl::Vector3d;  ///< x, y, z

  /// Refers to the vector.
  PointArray(const std::vector<Point>& points) : data_(points.data()), size_(points.size()) {}
  /// Copies the points of a list in braces.
  PointArray(std::initializer_list<Point> points)
      : copy_(points), data_(copy_.data()), size_(copy_.size()) {}
  /// Copies the points of a matrix.
  template <typename Derived>
  PointArray(const Eigen::MatrixBase<Derived>& points)
      : copy_(detail::pointsOf(points)), data_(copy_.data()), size_(copy_.size()) {}
  PointArray(const PointArray&) = delete;
  PointArray& operator=(const PointArray&) = delete;

  const Point* data() const { return data_; }  ///< one point after the other
  std::size_t size() const { return size_; }   ///< number of points

 private:
  std::vector<Point> copy_;
  const Point* data_;
  std::size_t size_;
};

}  // namespace adaptive_bvh
