#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// On which side of a closed surface a point lies, as far as that is known.
enum class SurfaceSide : std::uint8_t { Unknown, Outside, Inside };

/// A point in the target's frame, and what was measured there.
template <typename Witness>
struct DepthPoint {
  fcl::Vector3d x;
  fcl::Vector3d parameter = fcl::Vector3d::Zero();  ///< of a curved surface
  double distance = -1;                             ///< to the target's surface; -1: not measured
  Witness witness{};                                ///< what of the target has that distance
  SurfaceSide side = SurfaceSide::Unknown;

  bool isMeasured() const { return distance >= 0; }
};

/// A box that encloses part of a surface: its middle and half of its sides, in the target's frame.
struct TurnedBox {
  fcl::Vector3d middle;
  fcl::Matrix3d halves;  ///< a column each

  /// Radius of a ball around the middle that contains the corners. The sides are orthogonal only up
  /// to the error of the rotation.
  double radius() const { return std::sqrt((halves.transpose() * halves).cwiseAbs().sum()); }
};

/// How deep one surface, the source, reaches into a closed body, the target.
struct DepthBounds {
  double lower = 0, upper = 0;
  bool is_found = false;     ///< whether a point is deeper than what was known before
  fcl::Vector3d x;           ///< that point of the source, `lower` deep
  fcl::Vector3d nearest;     ///< of the target's surface
  fcl::Vector3d outward;     ///< direction of that surface there
  std::size_t searches = 0;  ///< how often the distance of a point was searched for

  /// No point yet; less does not matter.
  static DepthBounds from(double depth) {
    DepthBounds bounds;
    bounds.lower = bounds.upper = depth;
    return bounds;
  }
};

/// A point of a source, if it is deeper than `least` in the target.
template <typename Target>
DepthBounds depthAt(const fcl::Vector3d& x, Target& target, double least) {
  DepthPoint<typename Target::Witness> point;
  point.x = x;
  target.measure(point, {});
  DepthBounds bounds = DepthBounds::from(least);
  if (!(point.distance > least) || !target.isInside(x)) return bounds;
  bounds.lower = bounds.upper = point.distance;
  bounds.is_found = true;
  bounds.x = x;
  target.findNearest(point, bounds);
  return bounds;
}

}  // namespace adaptive_bvh
