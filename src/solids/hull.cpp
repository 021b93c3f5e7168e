#include "solids/hull.h"

#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "solids/patches.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// The unit direction from the nearest point of a convex set to x. The nearest point has an error
/// of 2^-44 of the size, so for a near x the direction is inaccurate. It is then recomputed for
/// points farther out in that direction, with a distance a thousand times larger each time. At a
/// distance below 2^-40 of the size, x counts as inside.
Vector outwardOf(const Vector& x, const Vector& nearest, double distance, const ConvexSet& set) {
  constexpr double kTouching = 0x1p-40, kFar = 1e-4, kFarther = 1e3;
  Vector outward = (x - nearest).stableNormalized();
  const Vector extent = set.support(outward) - set.support(-outward);
  const double size = std::max(x.lpNorm<Eigen::Infinity>(), extent.lpNorm<Eigen::Infinity>());
  if (distance <= kTouching * size) return -penetrationOf({x, x, x}, set).normal;
  for (double far = distance; far < kFar * size;) {
    far *= kFarther;
    const Vector y = nearest + far * outward;
    const ConvexGap gap = convexGap({y, y, y}, set);
    outward = (y - gap.points.second).stableNormalized();
  }
  return outward;
}

/// The first t >= begin at which the line is in a set, or infinity. Advances from point to point of
/// the line: a plane that separates the present point from the set bounds the next step.
double firstInSet(const Line& line, const ConvexSet& set, double begin) {
  constexpr int kMostSteps = 200;
  double t = begin;
  for (int step = 0; step < kMostSteps; ++step) {
    const Vector x = line.origin + t * line.direction;
    const ConvexGap gap = convexGap(TrianglePoints{x, x, x}, set);
    // The height of x above the support plane, and its decrease for each unit of t.
    const double height = gap.normal.dot(x - set.support(gap.normal)),
                 fall = -gap.normal.dot(line.direction);
    if (gap.distance <= 0 || !(height > 0)) break;
    if (!(fall > 0)) return std::numeric_limits<double>::infinity();
    const double next = t + height / fall;
    if (!(next > t)) break;
    t = next;
  }
  return t;
}

}  // namespace

Vector HullSolid::support(const Vector& direction) const {
  std::size_t best = 0;
  double most = direction.dot(points_[0]);
  for (std::size_t i = 1; i < count_; ++i) {
    const double along = direction.dot(points_[i]);
    if (along > most) most = along, best = i;
  }
  return points_[best];
}

TriangleGap HullSolid::gap(const Triangle& triangle) const {
  const ConvexGap gap = convexGap(triangle, *this);
  return {gap.points, gap.distance};
}

ShapeSurface HullSolid::surface(const Vector& x) const {
  const TrianglePoints point = {x, x, x};
  const ConvexGap gap = convexGap(point, *this);
  if (gap.distance > 0) {
    const Vector& nearest = gap.points.second;
    return {gap.distance, nearest, outwardOf(x, nearest, gap.distance, *this)};
  }
  const Penetration shortest = penetrationOf(point, *this);
  return {-shortest.depth, x - shortest.depth * shortest.normal, -shortest.normal};
}

/// The search begins at the support planes across the line: before them the line is outside.
LineInterval HullSolid::lineInside(const Line& line) const {
  const Vector &d = line.direction, low = support(-d), high = support(d);
  const double square = d.squaredNorm();
  const double begin = (low - line.origin).dot(d) / square,
               end = (high - line.origin).dot(d) / square;
  const double enter = firstInSet(line, *this, begin);
  if (enter == std::numeric_limits<double>::infinity()) return {};
  const double leave = -firstInSet({line.origin, -d}, *this, -end);
  return {enter, std::max(enter, leave)};
}

void HullSolid::addPatches(std::vector<SurfacePatch>& patches) const {
  const PatchList list(patches);
  forEachFace([&](const int* corners, std::size_t count) {
    for (std::size_t k = 2; k < count; ++k)
      list.addTriangle(point(corners[0]), point(corners[k - 1]), point(corners[k]));
  });
}

FacedHull::FacedHull(const HullSolid& hull) : HullSolid(hull) {
  const auto require = [](bool condition) {
    if (!condition)
      throw std::invalid_argument(
          "adaptive_bvh: signedDistance needs a convex whose faces enclose it: each edge must be "
          "run through once in each direction");
  };
  std::map<std::pair<int, int>, int> edges;
  forEachFace([&](const int* corners, std::size_t count) {
    require(count >= 3);
    for (std::size_t k = 0; k < count; ++k) {
      const int from = corners[k], to = corners[(k + 1) % count];
      require(from >= 0 && static_cast<std::size_t>(from) < this->count());
      ++edges[{from, to}];
      --edges[{to, from}];
    }
    for (std::size_t k = 2; k < count; ++k)
      addPlane(point(corners[0]), point(corners[k - 1]), point(corners[k]));
  });
  for (const auto& edge : edges) require(edge.second == 0);
  require(!planes_.empty());
}

/// Adds the plane of a triangle of a face, moved out to the farthest point of the hull. The normal
/// n may point inward; the hull lies on one side, which determines the outward one.
void FacedHull::addPlane(const Vector& a, const Vector& b, const Vector& c) {
  const Vector n = (b - a).cross(c - a).stableNormalized();
  if (n.isZero(0)) return;
  const double above = n.dot(support(n)), below = n.dot(support(-n)), height = n.dot(a);
  if (above - height <= height - below)
    planes_.push_back({n, above});
  else
    planes_.push_back({-n, -below});
}

ShapeSurface FacedHull::surface(const Vector& x) const {
  double highest = -std::numeric_limits<double>::infinity();
  const Plane* nearest = nullptr;
  for (const Plane& plane : planes_) {
    const double height = plane.n.dot(x) - plane.d;
    if (height > highest) highest = height, nearest = &plane;
  }
  return {highest, x - highest * nearest->n, nearest->n};
}

}  // namespace adaptive_bvh
