#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <fcl/geometry/collision_geometry.h>

#include "base/rounding.h"

namespace adaptive_bvh {

/// The bounding box of one or more positions.
template <typename S>
struct LocalBox {
  LocalBox(const fcl::Vector3<S>* positions, std::size_t count)
      : low(positions[0]), high(positions[0]) {
    for (std::size_t i = 1; i < count; ++i) {
      low = low.cwiseMin(positions[i]);
      high = high.cwiseMax(positions[i]);
    }
  }

  fcl::Vector3<S> low, high;
};

/// The bounding box of a body in its own frame, and the ball around the box's centre that encloses
/// the body. Member names are those of fcl::CollisionGeometry.
struct LocalBounds {
  fcl::AABBd aabb_local;
  fcl::Vector3d aabb_center = fcl::Vector3d::Zero();
  double aabb_radius = 0;
};

/// Sets the local box of a geometry or of LocalBounds, and its centre.
template <typename Geometry, typename S>
void setLocalBox(Geometry& geometry, const fcl::Vector3<S>& low, const fcl::Vector3<S>& high) {
  geometry.aabb_local.min_ = low;
  geometry.aabb_local.max_ = high;
  geometry.aabb_center = geometry.aabb_local.center();
}

/// Sets the radius of the ball around the centre of the local box. `squared` is the largest squared
/// distance of a vertex to the centre. If it is so small that squares lose digits, the radius is
/// computed from the box.
template <typename Geometry, typename S>
void setLocalRadius(Geometry& geometry, S squared) {
  constexpr S kLeast = std::numeric_limits<S>::min() / rounding::epsilon<S>();
  const fcl::AABB<S>& box = geometry.aabb_local;
  const fcl::Vector3<S>& middle = geometry.aabb_center;
  geometry.aabb_radius = squared > kLeast
                             ? std::sqrt(squared)
                             : (box.max_ - middle).cwiseMax(middle - box.min_).stableNorm();
}

/// Copies a mesh's bounds to an FCL geometry.
inline void copyBounds(const LocalBounds& bounds, fcl::CollisionGeometryd& geometry) {
  geometry.aabb_local = bounds.aabb_local;
  geometry.aabb_center = bounds.aabb_center;
  geometry.aabb_radius = bounds.aabb_radius;
}

/// Updates the local box of a geometry after some vertices have moved. If a vertex moves inward
/// from a side of the box, finish() recomputes the box from all vertices.
template <typename S>
class BoxAfterSome {
 public:
  /// Starts with the local box before the motion.
  explicit BoxAfterSome(const fcl::AABB<S>& local) : low_(local.min_), high_(local.max_) {}

  /// Records the motion of one vertex.
  void move(const fcl::Vector3<S>& from, const fcl::Vector3<S>& to) {
    for (int k = 0; k < 3; ++k) {
      moves_inward_ = moves_inward_ || (from[k] == low_[k] && to[k] > from[k]) ||
                      (from[k] == high_[k] && to[k] < from[k]);
      low_[k] = std::min(low_[k], to[k]);
      high_[k] = std::max(high_[k], to[k]);
    }
    squared_ = std::max(squared_, (to - from).squaredNorm());
  }
  /// The largest squared displacement.
  S squaredDisplacement() const { return squared_; }

  /// Sets box, centre and radius; call it after all positions are written. The radius is half the
  /// box's diagonal, rounded up: the ball encloses all vertices, though not tightly.
  template <typename Geometry>
  void finish(const fcl::Vector3<S>* vertices, std::size_t count, Geometry& geometry) const {
    fcl::Vector3<S> low = low_, high = high_;
    if (moves_inward_) {
      const LocalBox<S> all(vertices, count);
      low = all.low;
      high = all.high;
    }
    setLocalBox(geometry, low, high);
    const fcl::Vector3<S>& center = geometry.aabb_center;
    geometry.aabb_radius =
        rounding::norm<S>(fcl::Vector3<S>((high - center).cwiseMax(center - low)));
  }

 private:
  fcl::Vector3<S> low_, high_;  ///< the old box, extended by the new positions
  bool moves_inward_ = false;   ///< whether a vertex has moved inward from a side of the box
  S squared_ = 0;
};

}  // namespace adaptive_bvh
