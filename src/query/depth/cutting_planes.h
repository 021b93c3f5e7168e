#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// Upper bound of the largest value of a concave function in a triangle, by cutting planes (Kelley,
/// "The Cutting-Plane Method for Solving Convex Programs", 1960). A plane is a linear function that
/// is nowhere less than the concave function, given by its values at the three corners. An average
/// of planes is such a function, too. The bound is the least maximum of all these functions. By the
/// duality of linear programs, it is the largest value of the planes' minimum.
class CuttingPlanes {
 public:
  using Plane = fcl::Vector3d;

  double bound() const { return bound_.value; }
  /// The point at which the planes' minimum is largest, in barycentric coordinates.
  const fcl::Vector3d& highest() const { return highest_; }

  /// Adds a plane and recomputes `bound` and `highest`. Tries all single planes, pairs and triples:
  /// an optimal average needs at most three planes.
  void add(const Plane& plane) {
    if (count_ == kMost) forgetOldest();
    planes_[count_++] = plane;
    bound_.value = std::numeric_limits<double>::infinity();
    peak_ = -bound_.value;
    for (std::size_t i = 0; i < count_; ++i) {
      tryOne(i);
      for (std::size_t j = 0; j < i; ++j) {
        for (int corner = 0; corner < 3; ++corner) tryTwo(i, j, corner, (corner + 1) % 3);
        for (std::size_t k = 0; k < j; ++k) tryThree(i, j, k);
      }
    }
  }

 private:
  using Numbers = std::array<std::size_t, 3>;  ///< indices of planes; some may be equal
  /// The largest value of an average of planes.
  struct Bound {
    double value;
    Numbers planes;
  };
  static constexpr std::size_t kMost = 6;

  void tryAverage(const Plane& average, const Numbers& planes) {
    const double value = average.maxCoeff();
    if (value < bound_.value) bound_ = {value, planes};
  }
  void tryPoint(const fcl::Vector3d& point) {
    double value = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count_; ++i) value = std::min(value, planes_[i].dot(point));
    if (!(value > peak_)) return;
    peak_ = value;
    highest_ = point;
  }

  void tryOne(std::size_t i) {
    tryAverage(planes_[i], {i, i, i});
    int corner;
    planes_[i].maxCoeff(&corner);
    tryPoint(fcl::Vector3d::Unit(corner));
  }
  /// Tries the average of two planes that is constant along the edge between the corners a and b,
  /// and their intersection on it. If there is none, the divisions give an infinity or NaN.
  void tryTwo(std::size_t i, std::size_t j, int a, int b) {
    const Plane &p = planes_[i], &q = planes_[j];
    const double rise_p = p[b] - p[a], rise_q = q[b] - q[a];
    const double weight = rise_q / (rise_q - rise_p), share = (q[a] - p[a]) / (rise_p - rise_q);
    if (weight >= 0 && weight <= 1) tryAverage(weight * p + (1 - weight) * q, {i, j, j});
    if (!(share >= 0 && share <= 1)) return;
    fcl::Vector3d point = fcl::Vector3d::Zero();
    point[a] = 1 - share;
    point[b] = share;
    tryPoint(point);
  }
  /// Tries the average of three planes that is constant, and the intersection of the planes.
  void tryThree(std::size_t i, std::size_t j, std::size_t k) {
    fcl::Matrix3d m;  // a column for each plane, a row for each corner
    m << planes_[i], planes_[j], planes_[k];
    fcl::Vector3d weights = (m.row(0) - m.row(1)).cross(m.row(0) - m.row(2)).transpose(),
                  point = (m.col(0) - m.col(1)).cross(m.col(0) - m.col(2));
    weights /= weights.sum();
    point /= point.sum();
    if (weights.minCoeff() >= 0) tryAverage(m * weights, {i, j, k});
    if (point.minCoeff() >= 0) tryPoint(point);
  }
  /// Removes the oldest plane that is not part of the best average, so that the bound never rises.
  void forgetOldest() {
    const Numbers& kept = bound_.planes;
    std::size_t oldest = 0;
    while (kept[0] == oldest || kept[1] == oldest || kept[2] == oldest) ++oldest;
    std::copy(planes_.begin() + oldest + 1, planes_.begin() + count_, planes_.begin() + oldest);
    --count_;
  }

  std::array<Plane, kMost> planes_;
  std::size_t count_ = 0;
  Bound bound_;
  double peak_;  ///< the planes' minimum at highest_
  fcl::Vector3d highest_ = fcl::Vector3d::Constant(1. / 3);
};

}  // namespace adaptive_bvh
