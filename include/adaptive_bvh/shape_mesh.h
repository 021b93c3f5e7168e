#pragma once

#include <fcl/geometry/collision_geometry.h>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh {

/// The surface of one of FCL's shapes as triangles, in the shape's frame: closed, and
/// counter-clockwise seen from outside. Vertices lie on the surface. An octree gives the cubes of
/// its occupied cells, each with vertices of its own; a plane and a half-space, a square with sides
/// of 2 whose middle is the point nearest to the origin.
///
/// `turn`: edges around a full turn of what is round; rounded up to a power of two, from 8 to 1024.
///
/// Throws std::invalid_argument on any other geometry, on shapes with a size that is not positive
/// and finite, and on a `turn` outside of [1, 1024].
TriangleMesh shapeMesh(const fcl::CollisionGeometryd& shape, int turn = 64);

}  // namespace adaptive_bvh
