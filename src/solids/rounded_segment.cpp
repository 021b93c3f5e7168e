#include "solids/rounded_segment.h"

#include <algorithm>
#include <cmath>

#include "solids/cylinder.h"
#include "solids/patches.h"

namespace adaptive_bvh {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

TriangleGap RoundedSegment::coreGap(const Triangle& triangle) const {
  if (half_ != 0) {
    const Vector end(0, 0, half_);
    return gapOf(triangle, {end, -end, -end});
  }
  TriangleGap gap{{nearestPoint(triangle, Vector(Vector::Zero())), Vector::Zero()}, 0};
  gap.distance = gap.points.first.norm();
  return gap;
}

TriangleGap RoundedSegment::gap(const Triangle& triangle) const {
  TriangleGap gap = coreGap(triangle);
  const Vector& on_triangle = gap.points.first;
  if (gap.distance > radius_) {
    gap.points.second += (on_triangle - gap.points.second) * (radius_ / gap.distance);
    gap.distance -= radius_;
  } else {
    gap.points.second = on_triangle;
    gap.distance = 0;
  }
  return gap;
}

/// If the nearest points nearly coincide, the direction between them is dominated by rounding. Then
/// the shortest translation along it and along the separating axes of triangle and segment is used.
bool RoundedSegment::touches(const Triangle& triangle, ShapeContact& contact) const {
  constexpr double kReliable = 0x1p-20;
  const TriangleGap gap = coreGap(triangle);
  const Vector& on_triangle = gap.points.first;
  if (gap.distance > radius_) return false;
  double size = half_;
  for (const Vector& x : triangle) size = std::max(size, x.norm());
  const Vector between = gap.points.second - on_triangle;
  if (gap.distance > kReliable * size) {
    contact = {on_triangle, between / gap.distance, radius_ - gap.distance};
    return true;
  }
  ShortestTranslation shortest(triangle, [&](const Vector& m) { return half_ * std::abs(m[2]); });
  shortest.tryBoth(between);
  shortest.tryFaceNormal();
  for (const Vector& edge : edgesOf(triangle))
    shortest.tryBoth(acrossEdges(edge, Vector(0, 0, half_)));
  if (isThin(triangle)) {  // may be parallel to the segment
    shortest.tryBoth(Vector::UnitX());
    shortest.tryBoth(Vector::UnitY());
    for (const Vector& edge : edgesOf(triangle))
      if (half_ == 0 && !edge.isZero(0)) shortest.tryBoth(edge.unitOrthogonal());
  }
  contact = {on_triangle, shortest.normal(), std::max(0., radius_ + shortest.signedDepth())};
  return true;
}

ShapeSurface RoundedSegment::surface(const Vector& x) const {
  const Vector core(0, 0, std::clamp(x[2], -half_, half_)), from = x - core;
  const double length = from.stableNorm();
  const Vector outward = length > 0 ? Vector(from / length) : Vector::UnitX();
  return {length - radius_, core + radius_ * outward, outward};
}

LineInterval RoundedSegment::lineInside(const Line& line) const {
  const Vector end(0, 0, half_);
  const LineInterval upper = lineInBall<Vector>(line.origin - end, line.direction, radius_);
  if (half_ == 0) return upper;
  return upper.joined(lineInBall<Vector>(line.origin + end, line.direction, radius_))
      .joined(CylinderSolid(radius_, half_).lineInside(line));
}

void RoundedSegment::addPatches(std::vector<SurfacePatch>& to) const {
  const PatchList patches(to);
  const Vector radii = Vector::Constant(radius_);
  patches.addHalf(Vector(0, 0, half_), radii, 1);
  patches.addHalf(Vector(0, 0, -half_), radii, -1);
  if (half_ > 0) patches.addTurned(radius_, -half_, radius_, half_);
}

}  // namespace adaptive_bvh
