#pragma once

#include <fcl/geometry/collision_geometry.h>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh {

/// The surface of an FCL shape or octree as triangles to look at, in the shape's frame. Vertices
/// are repeated along sharp edges, so that a normal per vertex shades the faces as flat. A plane
/// and a half-space give a square with sides of 2, centred at the point nearest to the origin. An
/// octree gives the cubes of its occupied cells. Throws std::invalid_argument on any other
/// geometry.
template <typename S>
TriangleMesh<double> shapeMesh(const fcl::CollisionGeometry<S>& shape);

/// Whether `shape` is a plane or a half-space.
template <typename S>
bool isUnbounded(const fcl::CollisionGeometry<S>& shape) {
  return shape.getNodeType() == fcl::GEOM_PLANE || shape.getNodeType() == fcl::GEOM_HALFSPACE;
}

}  // namespace adaptive_bvh
