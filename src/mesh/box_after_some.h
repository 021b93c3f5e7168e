#pragma once

#include <algorithm>
#include <cstddef>

#include <fcl/geometry/collision_geometry.h>

#include "geometry/rounding.h"

namespace adaptive_bvh {

/// The box around some positions, at least one.
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

/// Sets the local box of a geometry, and its centre.
template <typename S>
void setLocalBox(fcl::CollisionGeometry<S>& geometry, const fcl::Vector3<S>& low,
                 const fcl::Vector3<S>& high) {
  geometry.aabb_local.min_ = low;
  geometry.aabb_local.max_ = high;
  geometry.aabb_center = geometry.aabb_local.center();
}

/// Moves the local box of a geometry along with some vertices. Where one leaves a side of it, only
/// all vertices can tell where that side is.
template <typename S>
class BoxAfterSome {
 public:
  explicit BoxAfterSome(const fcl::CollisionGeometry<S>& geometry)
      : low_(geometry.aabb_local.min_), high_(geometry.aabb_local.max_) {}

  /// A vertex moves.
  void move(const fcl::Vector3<S>& from, const fcl::Vector3<S>& to) {
    for (int k = 0; k < 3; ++k) {
      leaves_side_ = leaves_side_ || (from[k] == low_[k] && to[k] > from[k]) ||
                     (from[k] == high_[k] && to[k] < from[k]);
      low_[k] = std::min(low_[k], to[k]);
      high_[k] = std::max(high_[k], to[k]);
    }
    squared_ = std::max(squared_, (to - from).squaredNorm());
  }
  /// The largest one.
  S squaredDisplacement() const { return squared_; }

  /// After the last position is written: sets box, centre and radius. The radius is half the box's
  /// diagonal, rounded up: it holds all vertices, though not tightly.
  void finish(const fcl::Vector3<S>* vertices, std::size_t count,
              fcl::CollisionGeometry<S>& geometry) const {
    fcl::Vector3<S> low = low_, high = high_;
    if (leaves_side_) {
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
  fcl::Vector3<S> low_, high_;
  bool leaves_side_ = false;
  S squared_ = 0;
};

}  // namespace adaptive_bvh
