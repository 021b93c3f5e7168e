#include "solids/solid.h"

#include <algorithm>

namespace adaptive_bvh {

using fcl::Vector3d;

ShapeCore Solid::core() const {
  ShapeCore core;
  for (int k = 0; k < 3; ++k) {
    core.low[k] = support(-Vector3d::Unit(k))[k];
    core.high[k] = support(Vector3d::Unit(k))[k];
  }
  return core;
}

bool Solid::touches(const TrianglePoints& triangle, ShapeContact& contact) const {
  const TriangleGap common = gap(triangle);
  if (common.distance > 0) return false;
  const Penetration shortest = penetration(triangle);
  contact = {common.points.first, shortest.normal, shortest.depth};
  return true;
}

fcl::AABBd worldBoxOf(const PlacedSolid& placed) {
  const auto& [solid, tf] = placed;
  Vector3d low = tf.translation(), high = low;
  if (solid.hull()) {
    for (int i = 0; i < 3; ++i) {
      const Vector3d axis = tf.linear().row(i);  // a world axis in the shape's frame
      low[i] += axis.dot(solid.support(-axis));
      high[i] += axis.dot(solid.support(axis));
    }
    return fcl::AABBd(low, high);
  }
  const ShapeCore core = solid.core();
  const fcl::Matrix3d R = tf.linear() * core.axes;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      if (R(i, k) == 0) continue;  // avoids 0 times an infinite side
      low[i] += std::min(R(i, k) * core.low[k], R(i, k) * core.high[k]);
      high[i] += std::max(R(i, k) * core.low[k], R(i, k) * core.high[k]);
    }
    low[i] -= core.radius;
    high[i] += core.radius;
  }
  return fcl::AABBd(low, high);
}

}  // namespace adaptive_bvh
