#include "solids/round_solid.h"

#include <cmath>
#include <limits>

namespace adaptive_bvh {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// The distance of the shape from a point x of the edge e is convex along e. Its derivative is e n,
/// where n is the outward direction of the surface at the point y nearest to x; its root is found
/// by bisection and secants (the "Illinois" rule). n is not computed as x - y, which is inaccurate
/// near the surface, except at tips and rims, where Solid::surface returns a mean normal.
bool RoundSolid::considerEdge(const Vector& from, const Vector& to, TriangleGap& best) const {
  constexpr int kMostSteps = 200;
  constexpr double kParallel = 0.999;
  const Vector edge = to - from;
  bool is_inside = false;
  // The derivative at from + s e. Considers this point.
  const auto slopeAt = [&](double s) {
    const Vector x = s == 1 ? to : Vector(from + s * edge);
    const ShapeSurface at = surface(x);
    if (at.distance <= 0) {
      is_inside = true;
      best = {{x, x}, 0};
    } else if (at.distance < best.distance) {
      best = {{x, at.nearest}, at.distance};
    }
    const Vector away = x - at.nearest;
    const bool is_mean = away.dot(at.outward) < kParallel * at.distance;  // at a tip or a rim
    return is_mean ? edge.dot(away) / at.distance : edge.dot(at.outward);
  };
  double low = 0, high = 1, at_low = slopeAt(0), at_high = slopeAt(1);
  int last_side = 0;
  for (int i = 0; i < kMostSteps && !is_inside && at_low < 0 && at_high > 0; ++i) {
    const double s =
        i % 8 == 7 ? (low + high) / 2 : low - at_low * (high - low) / (at_high - at_low);
    if (!(s > low && s < high)) break;
    const double slope = slopeAt(s);
    if (slope == 0) break;
    const int side = slope < 0 ? -1 : 1;
    (side < 0 ? low : high) = s;
    (side < 0 ? at_low : at_high) = slope;
    if (side == last_side) (side < 0 ? at_high : at_low) /= 2;
    last_side = side;
  }
  return !is_inside;
}

bool RoundSolid::considerFace(const Triangle& triangle, TriangleGap& best) const {
  const Vector normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  if (normal.isZero(0)) return true;
  const Vector ends[2] = {support(-normal), support(normal)};  // the lowest and the highest point
  const double heights[2] = {normal.dot(ends[0] - triangle[0]), normal.dot(ends[1] - triangle[0])};
  if (heights[0] > 0 || heights[1] < 0) {
    const Vector& y = heights[0] > 0 ? ends[0] : ends[1];
    const Vector x = nearestPoint(triangle, y);
    const double distance = (x - y).norm();
    if (distance < best.distance) best = {{x, y}, distance};
    return true;
  }
  // The shape crosses the plane. As no edge intersects it, the whole crossing is either inside the
  // triangle or beside it, so one common point decides.
  const double share = heights[1] > heights[0] ? -heights[0] / (heights[1] - heights[0]) : 0;
  const Vector common = ends[0] + share * (ends[1] - ends[0]), x = nearestPoint(triangle, common);
  const double size = (triangle[1] - triangle[0]).norm() + (ends[1] - ends[0]).norm() +
                      (triangle[0] - common).norm();
  if ((x - common).norm() > 0x1p-48 * size) return true;
  best = {{x, x}, 0};
  return false;
}

TriangleGap RoundSolid::gap(const Triangle& triangle) const {
  TriangleGap best;
  best.distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k)
    if (!considerEdge(triangle[k], triangle[(k + 1) % 3], best)) return best;
  considerFace(triangle, best);
  return best;
}

}  // namespace adaptive_bvh
