#pragma once

#include "triangles/triangle_shape.h"

namespace adaptive_bvh {

/// A shape where it is in the world.
struct PlacedShape {
  const TriangleShape& shape;
  fcl::Transform3d tf;
};

/// The nearest points of two shapes, in the world; one common point and 0 where they touch. With a
/// sphere or a capsule, a plane or a half-space, by the other shape's own formula
/// (TriangleShape::gap, surface); of others by convexGap. Unbounded shapes are apart only where
/// they are parallel: up to 16 epsilon of S, with which their transforms were made.
template <typename S>
TriangleGap gapOf(const PlacedShape& first, const PlacedShape& second);

/// Whether two shapes touch, and where, in the world: the second moved by `depth` along `normal` is
/// apart from the first, and no shorter motion would do. The depth is infinite where no motion
/// separates two unbounded shapes.
template <typename S>
bool touch(const PlacedShape& first, const PlacedShape& second, ShapeContact& contact);

}  // namespace adaptive_bvh
