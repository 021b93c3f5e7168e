#pragma once

#include <functional>
#include <vector>

#include <fcl/geometry/collision_geometry.h>

#include "triangles/shape_surface.h"
#include "triangles/surface_chart.h"

namespace adaptive_bvh {

/// A bounded convex shape of FCL's that has an inside, in its frame.
struct SolidShape {
  /// The part of the surface over a triangle of parameters.
  struct Patch {
    SurfaceChart chart;
    fcl::Vector3d p, q, r;
  };

  std::function<ShapeSurface(const fcl::Vector3d& x)> surface;
  std::function<fcl::Vector3d(const fcl::Vector3d& n)> support;  ///< the farthest point along n
  fcl::Vector3d inner = fcl::Vector3d::Zero();                   ///< a point in the shape
  /// Every point of the surface is on a ball of this radius inside the shape.
  double rolling_radius = 0;
  /// They cover the surface. Those of one chart follow each other; of charts there are at most
  /// three.
  std::vector<Patch> patches;
};

/// Throws std::invalid_argument for any other geometry, and where the faces of a convex do not
/// enclose it.
template <typename S>
SolidShape solidOf(const fcl::CollisionGeometry<S>& shape);

}  // namespace adaptive_bvh
