#pragma once

#include <limits>

#include "solids/solid.h"

namespace adaptive_bvh {

/// The largest sine that rounding of transforms produces for parallel directions.
constexpr double kParallel = 16 * std::numeric_limits<double>::epsilon();

/// The nearest points of two shapes, in the world; a common point and distance 0 if they touch.
/// Pairs with a sphere, capsule, plane or half-space use the other shape's own formula (Solid::gap,
/// surface); other pairs use convexGap. Unbounded shapes are apart only if they are parallel: if
/// the sine of their angle is at most kParallel.
TriangleGap gapOf(const PlacedSolid& first, const PlacedSolid& second);

/// Whether two shapes touch; if so, sets the contact, in the world: translating the second by
/// `depth` along `normal` separates them, and no shorter translation does. The depth is infinite if
/// no translation separates two unbounded shapes.
bool touch(const PlacedSolid& first, const PlacedSolid& second, ShapeContact& contact);

}  // namespace adaptive_bvh
