#include "triangles/triangle_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "triangles/convex_distance.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints<double>;

/// Products of edges may be rounding alone where edges are parallel.
Vector acrossEdges(const Vector& e, const Vector& f) {
  const Vector across = e.cross(f);
  const double least = 0x1p-40 * e.norm() * f.norm();
  return across.norm() > least ? across : Vector::Zero();
}

std::array<Vector, 3> edgesOf(const Triangle& t) { return {t[1] - t[0], t[2] - t[1], t[0] - t[2]}; }

}  // namespace

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

/// Where the nearest points nearly coincide, the line between them is mostly rounding: then the
/// shortest way along it and along the axes of triangle and segment is taken.
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
  ShortestWay way(triangle, [&](const Vector& m) { return half_ * std::abs(m[2]); });
  way.tryBoth(between);
  way.tryFaceNormal();
  for (const Vector& edge : edgesOf(triangle)) way.tryBoth(acrossEdges(edge, Vector(0, 0, half_)));
  if (isThin(triangle)) {  // parallel to the segment, perhaps
    way.tryBoth(Vector::UnitX());
    way.tryBoth(Vector::UnitY());
    for (const Vector& edge : edgesOf(triangle))
      if (half_ == 0 && !edge.isZero(0)) way.tryBoth(edge.unitOrthogonal());
  }
  contact = {on_triangle, way.normal(), std::max(0., radius_ + way.signedDepth())};
  return true;
}

/// A triangle that is apart from a box is nearest to a face whose plane it is beyond, at least with
/// a corner; and one that crosses the box, without a corner inside, crosses such a face.
TriangleGap BoxShape::gap(const Triangle& triangle) const {
  for (const Vector& x : triangle)
    if ((x.cwiseAbs().array() <= half_.array()).all()) return {{x, x}, 0};
  TriangleGap nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1., 1.}) {
      const double beyond =
          std::max({side * triangle[0][k], side * triangle[1][k], side * triangle[2][k]});
      if (beyond < half_[k]) continue;
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const auto corner = [&](double u, double v) -> Vector {
        Vector x;
        x[k] = side * half_[k];
        x[i] = u * half_[i];
        x[j] = v * half_[j];
        return x;
      };
      for (const double w : {-1., 1.}) {
        const TriangleGap gap = gapOf(triangle, {corner(-1, -1), corner(1, 1), corner(w, -w)});
        if (gap.distance < nearest.distance) nearest = gap;
        if (nearest.distance <= 0) return nearest;
      }
    }
  return nearest;
}

bool BoxShape::touches(const Triangle& triangle, ShapeContact& contact) const {
  const TriangleGap common = gap(triangle);
  if (common.distance > 0) return false;
  ShortestWay way(triangle, [&](const Vector& m) { return half_.dot(m.cwiseAbs()); });
  for (int k = 0; k < 3; ++k) way.tryBoth(Vector::Unit(k));
  way.tryFaceNormal();
  for (const Vector& edge : edgesOf(triangle))
    for (int k = 0; k < 3; ++k) way.tryBoth(acrossEdges(edge, Vector::Unit(k)));
  contact = {common.points.first, way.normal(), std::max(0., way.signedDepth())};
  return true;
}

FlatShape::Extremes FlatShape::extremes(const Triangle& triangle) const {
  Extremes of = {0, 0, std::numeric_limits<double>::infinity(), 0};
  of.high = -of.low;
  for (std::size_t k = 0; k < 3; ++k) {
    const double height = n_.dot(triangle[k]) - d_;
    if (height < of.low) of.low = height, of.lowest = k;
    if (height > of.high) of.high = height, of.highest = k;
  }
  return of;
}

TriangleGap FlatShape::gap(const Triangle& triangle) const {
  const Extremes of = extremes(triangle);
  const Vector &lowest = triangle[of.lowest], &highest = triangle[of.highest];
  if (of.low > 0) return {{lowest, lowest - of.low * n_}, of.low};
  if (!is_solid_ && of.high < 0) return {{highest, highest - of.high * n_}, -of.high};
  Vector common = lowest;
  if (!is_solid_ && of.high > of.low) common += (highest - common) * (of.low / (of.low - of.high));
  return {{common, common}, 0};
}

bool FlatShape::touches(const Triangle& triangle, ShapeContact& contact) const {
  const TriangleGap common = gap(triangle);
  if (common.distance > 0) return false;
  const Extremes of = extremes(triangle);
  // The shape goes down below the triangle, or a plane up above it.
  const bool is_down = is_solid_ || -of.low <= of.high;
  contact = {common.points.first, is_down ? Vector(-n_) : n_,
             std::max(is_down ? -of.low : of.high, 0.)};
  return true;
}

bool ConvexShape::touches(const Triangle& triangle, ShapeContact& contact) const {
  const TriangleGap common = gap(triangle);
  if (common.distance > 0) return false;
  const Penetration way = set_.penetration(triangle);
  contact = {common.points.first, way.normal, way.depth};
  return true;
}

/// Along an edge e, the derivative of the distance is e n, with the outward direction n of the
/// surface at the point y nearest to x: it increases. (x - y gives n only at tips and rims, since
/// it has few digits near the surface.) A root is found by bisection and secants (the "Illinois"
/// rule).
bool RoundShape::considerEdge(const Vector& from, const Vector& to, TriangleGap& best) const {
  constexpr int kMostSteps = 200;
  constexpr double kParallel = 0.999;
  const Vector edge = to - from;
  bool is_inside = false;
  const auto slopeAt = [&](double s) {
    const Vector x = s == 1 ? to : Vector(from + s * edge);
    const ShapeSurface at = round_set_.surface(x);
    if (at.distance <= 0) {
      is_inside = true;
      best = {{x, x}, 0};
    } else if (at.distance < best.distance) {
      best = {{x, at.nearest}, at.distance};
    }
    const Vector away = x - at.nearest;
    const bool is_mean = away.dot(at.outward) < kParallel * at.distance;
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

bool RoundShape::considerFace(const Triangle& triangle, TriangleGap& best) const {
  const Vector normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  if (normal.isZero(0)) return true;
  const Vector ends[2] = {round_set_.support(-normal), round_set_.support(normal)};
  const double heights[2] = {normal.dot(ends[0] - triangle[0]), normal.dot(ends[1] - triangle[0])};
  if (heights[0] > 0 || heights[1] < 0) {
    const Vector& y = heights[0] > 0 ? ends[0] : ends[1];
    const Vector x = nearestPoint(triangle, y);
    const double distance = (x - y).norm();
    if (distance < best.distance) best = {{x, y}, distance};
    return true;
  }
  // The set reaches through the plane. If no edge meets it, it does so inside the triangle or
  // beside.
  const double share = heights[1] > heights[0] ? -heights[0] / (heights[1] - heights[0]) : 0;
  const Vector common = ends[0] + share * (ends[1] - ends[0]), x = nearestPoint(triangle, common);
  const double size = (triangle[1] - triangle[0]).norm() + (ends[1] - ends[0]).norm() +
                      (triangle[0] - common).norm();
  if ((x - common).norm() > 0x1p-48 * size) return true;
  best = {{x, x}, 0};
  return false;
}

TriangleGap RoundShape::gap(const Triangle& triangle) const {
  TriangleGap best;
  best.distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k)
    if (!considerEdge(triangle[k], triangle[(k + 1) % 3], best)) return best;
  considerFace(triangle, best);
  return best;
}

TriangleGap HullShape::gap(const Triangle& triangle) const {
  const ConvexGap gap = convexGap(triangle, set());
  return {gap.points, gap.distance};
}

}  // namespace adaptive_bvh
