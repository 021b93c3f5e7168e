#pragma once

#include <array>

#include <Eigen/Core>

#include "base/vectors.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {

using PlainTriangle = std::array<Eigen::Vector3d, 3>;

/// Of any shape: slivers, segments and points among them.
inline PlainTriangle anyTriangle(RandomGeometry& random, const Eigen::Vector3d& place,
                                 double size) {
  PlainTriangle t;
  for (Eigen::Vector3d& corner : t) corner = place + size * random.point();
  switch (random.below(6)) {
    case 0: t[2] = t[0] + random.uniform(0, 1) * (t[1] - t[0]); break;
    case 1: t[1] = t[0]; break;
    case 2: t[2] = t[1] + 1e-4 * size * random.point(); break;
    default: break;
  }
  return t;
}

/// The corners of one lane, off by `error`, as single precision.
inline void setLane(adaptive_bvh::Vector4x3 (&to)[3], int lane, const PlainTriangle& corners,
                    double error, RandomGeometry& random) {
  for (std::size_t c = 0; c < 3; ++c) {
    const Eigen::Vector3d x = corners[c] + 0.99 * error * random.point();
    to[c].x[lane] = static_cast<float>(x[0]);
    to[c].y[lane] = static_cast<float>(x[1]);
    to[c].z[lane] = static_cast<float>(x[2]);
  }
}
/// What single precision may add to that, below 2.
constexpr double kLaneRounding = 8. * 2 / (1 << 24);

inline exact::Triangle exactly(const PlainTriangle& t) {
  return {exact::of(t[0]), exact::of(t[1]), exact::of(t[2])};
}

}  // namespace adaptive_bvh_test
