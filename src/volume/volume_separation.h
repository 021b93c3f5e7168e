#pragma once

#include <algorithm>
#include <cmath>

#include "volume/volume.h"

namespace adaptive_bvh {

/// How far apart two volumes lie, at least: the largest of their separations along both normals,
/// the line between their middles, and a direction of the caller's. Surfaces that face each other
/// are apart along one of these. Takes a seventh of the time of FCL's distance of two such volumes,
/// and prunes nearly as well.
template <typename BV>
class VolumeSeparation {
 public:
  using S = typename BV::S;
  using V = Volume<BV>;
  using Point = fcl::Vector3<S>;

  /// (R, T) takes the second model's coordinates to the first's. The sums bound
  /// Volume::cornerSum of the volumes, each in its own coordinates.
  VolumeSeparation(const fcl::Matrix3<S>& R, const Point& T, S coordinate_sum1, S coordinate_sum2)
      : R_(R),
        T_(T),
        error_(64 * rounding::epsilon<S>() *
                   (T.template lpNorm<1>() + 2 * coordinate_sum1 + 2 * coordinate_sum2) +
               rounding::tiny<S>()) {}

  /// Covers the rounding of a separation along a unit vector.
  S error() const { return error_; }

  /// A lower bound of the distance of the volumes. `direction`: any vector of length 1 up to
  /// rounding, in the first model's coordinates. Stops once the bound reaches `enough`.
  ///
  /// Along a unit vector a volume extends as Volume::SweptParallelogram says. All quantities are
  /// sums of a few products no larger than the coordinate sums: 64 epsilon of those covers their
  /// rounding and that of the axes' and directions' length.
  S operator()(const BV& first, const BV& second, const Point& direction, S enough) const {
    const auto a = V::parallelogram(first), b = V::parallelogram(second);
    const Point b_half[2] = {R_ * b.half[0], R_ * b.half[1]};
    const Point between = R_ * b.middle + T_ - a.middle;
    const S radii = a.radius + b.radius + error_;
    const auto along = [&](const Point& u) {
      return std::abs(u.dot(between)) - std::abs(u.dot(a.half[0])) - std::abs(u.dot(a.half[1])) -
             std::abs(u.dot(b_half[0])) - std::abs(u.dot(b_half[1])) - radii;
    };
    S best = along(direction);
    if (best < enough) best = std::max(best, along(V::normal(first)));
    if (best < enough) best = std::max(best, along(R_ * V::normal(second)));
    if (best < enough && !between.isZero(0)) best = std::max(best, along(between.normalized()));
    return best;
  }

 private:
  fcl::Matrix3<S> R_;
  Point T_;
  S error_;
};

}  // namespace adaptive_bvh
