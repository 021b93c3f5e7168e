#include "triangles/shape_rays.h"

#include <algorithm>
#include <cmath>

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// All t with a + t b <= 0.
LineInterval whereNotPositive(double a, double b) {
  if (b == 0) return a <= 0 ? LineInterval::all() : LineInterval();
  return b > 0 ? LineInterval{-kInfinity, -a / b} : LineInterval{-a / b, kInfinity};
}

/// All t with |from + t along| <= radius, in any number of dimensions: from the point of the line
/// that is nearest to the centre on, so that a far origin costs no digits.
template <typename Point>
LineInterval lineInBall(const Point& from, const Point& along, double radius) {
  const double square = along.squaredNorm();
  if (!(square > 0)) return from.norm() <= radius ? LineInterval::all() : LineInterval();
  const double middle = -from.dot(along) / square;
  const double off = (from + middle * along).norm();
  if (!(off <= radius)) return {};
  const double half = std::sqrt((radius - off) * (radius + off) / square);
  return {middle - half, middle + half};
}

LineInterval lineInSlab(const Line& line, int axis, double half) {
  const double x = line.origin[axis], d = line.direction[axis];
  return whereNotPositive(x - half, d) & whereNotPositive(-x - half, -d);
}

/// Of convex parts of a convex shape.
LineInterval hull(const LineInterval& a, const LineInterval& b) {
  if (a.isEmpty()) return b;
  if (b.isEmpty()) return a;
  return {std::min(a.enter, b.enter), std::max(a.leave, b.leave)};
}

/// The line from its nearest point to the origin on: find(line) by that, in the line's own t.
template <typename Find>
LineInterval fromNearest(const Line& line, const Find& find) {
  const double square = line.direction.squaredNorm();
  const double shift = -line.origin.dot(line.direction) / square;
  if (!std::isfinite(shift)) return find(line);
  LineInterval found = find(Line{line.origin + shift * line.direction, line.direction});
  found.enter += shift;
  found.leave += shift;
  return found;
}

}  // namespace

LineInterval lineInCylinder(const Line& line, double radius, double half) {
  return fromNearest(line, [&](const Line& x) {
    return lineInBall<Eigen::Vector2d>(x.origin.head<2>(), x.direction.head<2>(), radius) &
           lineInSlab(x, 2, half);
  });
}

LineInterval lineInRoundedSegment(const Line& line, double radius, double half) {
  const Vector end(0, 0, half);
  LineInterval found = lineInBall<Vector>(line.origin - end, line.direction, radius);
  if (half == 0) return found;
  found = hull(found, lineInBall<Vector>(line.origin + end, line.direction, radius));
  return hull(found, lineInCylinder(line, radius, half));
}

LineInterval lineInBox(const Line& line, const Vector& half) {
  return lineInSlab(line, 0, half[0]) & lineInSlab(line, 1, half[1]) & lineInSlab(line, 2, half[2]);
}

LineInterval lineInHalfSpace(const Line& line, const Vector& n, double d) {
  return whereNotPositive(n.dot(line.origin) - d, n.dot(line.direction));
}
LineInterval lineInPlane(const Line& line, const Vector& n, double d) {
  const double height = n.dot(line.origin) - d, rise = n.dot(line.direction);
  if (rise == 0) return {};
  return {-height / rise, -height / rise};
}

/// Between base and tip, where the distance from the axis is at most slope (half - z): a quadratic
/// inequality, which one of two cones beside the tip solves as well.
LineInterval lineInCone(const Line& given, double radius, double half) {
  const double slope = radius / (2 * half);
  return fromNearest(given, [&](const Line& line) -> LineInterval {
    const LineInterval slab = lineInSlab(line, 2, half);
    if (slab.isEmpty()) return {};
    const Eigen::Vector2d x = line.origin.head<2>(), d = line.direction.head<2>();
    const double s = slope * (half - line.origin[2]), ds = -slope * line.direction[2];
    const double a = d.squaredNorm() - ds * ds, b = x.dot(d) - s * ds, c = x.squaredNorm() - s * s;
    if (a == 0) return slab & whereNotPositive(c, 2 * b);
    // b b - a c, as a sum without the cancellation of large products.
    const double cross = x[0] * d[1] - x[1] * d[0];
    const double root2 = (x * ds - d * s).squaredNorm() - cross * cross;
    if (root2 < 0) return a > 0 ? LineInterval() : slab;
    const double sum = -(b + std::copysign(std::sqrt(root2), b));
    double first = sum / a, second = sum == 0 ? first : c / sum;
    if (first > second) std::swap(first, second);
    if (a > 0) return slab & LineInterval{first, second};
    return slab & (ds < 0 ? LineInterval{-kInfinity, first} : LineInterval{second, kInfinity});
  });
}

LineInterval lineInEllipsoid(const Line& line, const Vector& radii) {
  return lineInBall<Vector>(line.origin.cwiseQuotient(radii), line.direction.cwiseQuotient(radii),
                            1);
}

namespace {

/// The first t >= begin in a set, or infinity: each plane between a point of the line and the set
/// says how far the line may go on.
double firstInSet(const Line& line, const ConvexSet& set, double begin) {
  constexpr int kMostSteps = 200;
  double t = begin;
  for (int step = 0; step < kMostSteps; ++step) {
    const Vector x = line.origin + t * line.direction;
    const ConvexGap gap = convexGap(TrianglePoints<double>{x, x, x}, set);
    const double height = gap.normal.dot(x - set.support(gap.normal)),
                 fall = -gap.normal.dot(line.direction);
    if (gap.distance <= 0 || !(height > 0)) break;
    if (!(fall > 0)) return kInfinity;
    const double next = t + height / fall;
    if (!(next > t)) break;
    t = next;
  }
  return t;
}

}  // namespace

LineInterval lineInConvexSet(const Line& line, const ConvexSet& set) {
  const Vector &d = line.direction, low = set.support(-d), high = set.support(d);
  const double square = d.squaredNorm();
  const double begin = (low - line.origin).dot(d) / square,
               end = (high - line.origin).dot(d) / square;
  const double enter = firstInSet(line, set, begin);
  if (enter == kInfinity) return {};
  const double leave = -firstInSet({line.origin, -d}, set, -end);
  return {enter, std::max(enter, leave)};
}

}  // namespace adaptive_bvh
