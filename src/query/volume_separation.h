#pragma once

#include <algorithm>
#include <cmath>

#include <fcl/math/bv/RSS.h>

#include "volume/rounding.h"

namespace adaptive_bvh {

/// How far apart two rectangle-swept spheres lie, at least: the largest of their separations along
/// both rectangles' normals, the line between their middles, and a direction that someone hopes
/// for. Surfaces that face each other are apart along one of these. A seventh of FCL's distance of
/// two such volumes in time, and nearly as good at pruning.
template <typename S>
class VolumeSeparation {
 public:
  using Point = fcl::Vector3<S>;
  using BV = fcl::RSS<S>;

  /// (R, T) takes the second model's coordinates to the first's. `reach` bounds |x| + |y| + |z| of
  /// what fixes the volumes, each in its own coordinates, and their radii.
  VolumeSeparation(const fcl::Matrix3<S>& R, const Point& T, S reach1, S reach2)
      : R_(R),
        T_(T),
        error_(64 * rounding::epsilon<S>() * (T.template lpNorm<1>() + 2 * reach1 + 2 * reach2) +
               rounding::tiny<S>()) {}

  /// A lower bound of the distance of the volumes; any direction will do, of length 1 up to
  /// rounding, in the first model's coordinates. Not more is looked for once `enough` is reached.
  ///
  /// Along a unit vector u the volume reaches from its middle as far as |u a| + |u b| + r, a and b
  /// half the sides of its rectangle. All quantities are sums of a few products no larger than
  /// `reach`: 64 epsilon of that covers their rounding and that of the axes' and directions'
  /// length.
  S operator()(const BV& first, const BV& second, const Point& direction, S enough) const {
    const Point a1 = first.axis.col(0) * (first.l[0] / 2),
                b1 = first.axis.col(1) * (first.l[1] / 2);
    const Point a2_own = second.axis.col(0) * (second.l[0] / 2),
                b2_own = second.axis.col(1) * (second.l[1] / 2);
    const Point a2 = R_ * a2_own, b2 = R_ * b2_own;
    const Point between = R_ * (second.To + a2_own + b2_own) + T_ - (first.To + a1 + b1);
    const S radii = first.r + second.r + error_;
    const auto along = [&](const Point& u) {
      return std::abs(u.dot(between)) - std::abs(u.dot(a1)) - std::abs(u.dot(b1)) -
             std::abs(u.dot(a2)) - std::abs(u.dot(b2)) - radii;
    };
    S best = along(direction);
    if (best < enough) best = std::max(best, along(first.axis.col(2)));
    if (best < enough) best = std::max(best, along(R_ * second.axis.col(2)));
    if (best < enough && !between.isZero(0)) best = std::max(best, along(between.normalized()));
    return best;
  }

 private:
  fcl::Matrix3<S> R_;
  Point T_;
  S error_;
};

}  // namespace adaptive_bvh
