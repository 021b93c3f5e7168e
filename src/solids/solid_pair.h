#pragma once

#include "solids/solid.h"

namespace adaptive_bvh {

/// The nearest points of two shapes, in the world; one common point and 0 where they touch. With a
/// sphere or a capsule, a plane or a half-space, by the other shape's own formula (Solid::gap,
/// surface); of others by convexGap. Unbounded shapes are apart only where they are parallel: where
/// the sine of their angle is at most `parallel`.
TriangleGap gapOf(const PlacedSolid& first, const PlacedSolid& second, double parallel);

/// Whether two shapes touch, and where, in the world: the second moved by `depth` along `normal` is
/// apart from the first, and no shorter motion would do. The depth is infinite where no motion
/// separates two unbounded shapes.
bool touch(const PlacedSolid& first, const PlacedSolid& second, double parallel,
           ShapeContact& contact);

/// The sine of an angle that rounding of transforms in S makes of none.
template <typename S>
constexpr double kParallelIn = 16 * double(std::numeric_limits<S>::epsilon());

}  // namespace adaptive_bvh
