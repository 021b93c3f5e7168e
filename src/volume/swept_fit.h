#pragma once

#include <limits>

#include "volume/principal_axes.h"
#include "volume/swept_rectangle.h"

namespace adaptive_bvh {

/// What a fit decides: axes, and along given axes a rectangle with a sphere. Rounding errors here
/// cost tightness, never containment: whoever fits measures the radius afterwards.

/// A choice of sides and sphere, with what they need around some points.
template <typename S>
struct Shape {
  Direction<S> side;
  Slab<S> slab;
  Rectangle<S> rectangle;
  S area = std::numeric_limits<S>::infinity();
};

/// Keeps the better of a shape and the one with another slab. Returns the rectangle of the latter:
/// without its corners when it is larger already, for these only add to the area.
template <typename S>
Rectangle<S> attempt(Shape<S>& best, const LocalPoints<S>& turned, const Direction<S>& side,
                     const Slab<S>& slab) {
  Rectangle<S> rectangle = rectangleWithoutCorners(turned, slab);
  if (!(rectangle.sweptArea(slab.radius) < best.area)) return rectangle;
  growCorners(rectangle, turned, slab);
  const S area = rectangle.sweptArea(slab.radius);
  if (area < best.area) best = {side, slab, rectangle, area};
  return rectangle;
}

/// Keeps the best of the shapes with a given side, along which the points are turned. A sphere of
/// half the thickness is the least that will do, but not always the best: over a dome, a larger one
/// lets the rectangle end far within the rim. Returns false for a set so flat that this cannot
/// matter.
template <typename S>
bool improve(Shape<S>& best, const LocalPoints<S>& turned, const Direction<S>& side) {
  const Interval<S> z = heights(turned);
  const S middle = (z.low + z.high) / 2, half = z.length() / 2;
  const Rectangle<S> least = attempt(best, turned, side, {middle, half});
  const bool thick = half > S(0.1) * (least.x.length() + least.y.length());
  if (thick)
    for (S shift : {-half / 2, half / 2})
      attempt(best, turned, side, {middle + shift, S(1.5) * half});
  return thick;
}

/// The points that decide: all, or evenly picked ones.
template <typename S>
const PointArrays<S>& judges(const PointArrays<S>& points, PointArrays<S>& few) {
  constexpr std::size_t kJudges = 64;
  if (points.size() <= kJudges) return points;
  few.assign(points, (points.size() + kJudges - 1) / kJudges);
  return few;
}

/// The normal is the direction of least variance. Which sides suit it best is judged on a few
/// points. `few` and `local` are work space.
template <typename S>
fcl::Matrix3<S> bestAxes(const PointArrays<S>& points, PointArrays<S>& few, PointArrays<S>& local) {
  const fcl::Matrix3<S> axes = principalAxes(points);
  local.assign(judges(points, few), axes);
  Shape<S> shape;
  const Direction<S> side = bestDirection(local);
  if (side.y == 0) return axes;
  local.turn(side.x, side.y);
  if (improve(shape, local, side)) {
    local.turn(side.x, -side.y);
    improve(shape, local, Direction<S>());
  }
  const auto& [x, y] = shape.side;
  fcl::Matrix3<S> turned;
  turned << axes.col(0) * x + axes.col(1) * y, axes.col(1) * x - axes.col(0) * y, axes.col(2);
  return turned;
}

/// The rectangle and the sphere along given axes; `local` becomes the points along them, about the
/// first. The sphere is judged on a few points; then all are enclosed.
template <typename S>
Shape<S> shapeAlong(const fcl::Matrix3<S>& axes, const PointArrays<S>& points, PointArrays<S>& few,
                    PointArrays<S>& local) {
  Shape<S> shape;
  const PointArrays<S>& deciding = judges(points, few);
  local.assign(deciding, axes);
  improve(shape, local, Direction<S>());
  if (&deciding == &points) return shape;
  local.assign(points, axes);
  const Interval<S> z = heights(local);
  Slab<S>& slab = shape.slab;
  slab.radius = std::max({slab.radius, z.high - slab.middle, slab.middle - z.low});
  shape.rectangle = rectangleWithoutCorners(local, slab);
  growCorners(shape.rectangle, local, slab);
  shape.area = shape.rectangle.sweptArea(slab.radius);
  return shape;
}

}  // namespace adaptive_bvh
