#include "triangles/triangle_contact.h"

#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "triangles/feature_distance.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {
namespace {

using Point = fcl::Vector3d;

/// The normal of a triangle; its length is twice the area.
Point normalOf(const TrianglePoints& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

Point longestEdge(const TrianglePoints& t) {
  Point longest = t[1] - t[0];
  for (const Point& edge : {Point(t[2] - t[1]), Point(t[0] - t[2])})
    if (edge.squaredNorm() > longest.squaredNorm()) longest = edge;
  return longest;
}

/// A unit normal for the contact of a and b: the normal of a or the opposite of that of b, or, if
/// both are thin, a direction perpendicular to their longest edges.
Point anyNormal(const TrianglePoints& a, const TrianglePoints& b) {
  if (!isThin(a)) return normalOf(a).stableNormalized();
  if (!isThin(b)) return -normalOf(b).stableNormalized();
  const Point e = longestEdge(a), f = longestEdge(b), across = e.cross(f);
  if (across.norm() > rounding::epsilon<double>() * 64 * e.norm() * f.norm())
    return across.stableNormalized();
  if (!e.isZero(0)) return e.stableNormalized().unitOrthogonal();
  return f.isZero(0) ? Point::UnitZ() : f.stableNormalized().unitOrthogonal();
}

/// The plane of a triangle that is not thin: n x = t, n of length 1.
struct Plane {
  explicit Plane(const TrianglePoints& triangle) : n(normalOf(triangle).normalized()) {
    t = n.dot(triangle[0]);
  }
  Point n;
  double t;
};

/// The corners of a triangle that are deepest below a plane; none if all corners lie on one side.
struct Deepest {
  Deepest(const TrianglePoints& triangle, const Plane& plane) {
    // FCL's tolerances: for points on the plane, and for corners that are equally deep.
    constexpr double kOn = 1e-5, kAsDeep = 1e-6;
    bool is_above = true, is_below = true;
    for (const Point& x : triangle) {
      const double below = plane.t - plane.n.dot(x);
      is_above = is_above && below < -kOn;
      is_below = is_below && below > kOn;
      if (below > depth) {
        depth = below;
        count = 0;
      } else if (!(below + kAsDeep >= depth)) {
        continue;
      }
      if (count < 2) points[count++] = x;
    }
    if (is_above || is_below) count = 0;
  }

  double depth = std::numeric_limits<double>::lowest();
  unsigned count = 0;  ///< number of points: at most two, as in FCL
  Point points[2];
};

/// FCL's contact of two intersecting triangles, neither of them thin. The points are the corners of
/// one triangle that are deepest below the plane of the other; the triangle whose depth is smaller
/// supplies them. No points if rounding hides the intersection.
TriangleContact contactByPlanes(const TrianglePoints& a, const TrianglePoints& b) {
  const Plane plane_a(a), plane_b(b);
  const Deepest deepest_a(a, plane_b), deepest_b(b, plane_a);
  const bool takes_b = deepest_a.depth > deepest_b.depth;
  const Deepest& deepest = takes_b ? deepest_b : deepest_a;
  return {deepest.count,
          {deepest.points[0], deepest.points[1]},
          takes_b ? plane_a.n : Point(-plane_b.n),
          deepest.depth};
}

/// Whether a contact has points and only finite numbers.
bool isComplete(const TriangleContact& contact) {
  bool finite = contact.normal.allFinite() && std::isfinite(contact.depth);
  for (unsigned i = 0; i < contact.count; ++i) finite = finite && contact.points[i].allFinite();
  return contact.count > 0 && finite;
}

}  // namespace

Point nearestPoint(const TrianglePoints& t, const Point& x) {
  Point nearest;
  feature_distance::Face(t).distance(x, nearest);
  return nearest;
}

/// Whether twice the area is at most sqrt(epsilon) of the square of the longest edge. Then the
/// error of the normal's direction is as large as the triangle is wide.
bool isThin(const TrianglePoints& t) {
  return normalOf(t).norm() <=
         std::sqrt(rounding::epsilon<double>()) * longestEdge(t).squaredNorm();
}

TriangleContact contactOf(const TrianglePoints& a, const TrianglePoints& b) {
  TriangleContact contact;
  if (!isThin(a) && !isThin(b)) {
    contact = contactByPlanes(a, b);
    if (isComplete(contact)) return contact;
  }
  const PointPair nearest = gapOf(a, b).points;
  contact.count = 1;
  contact.points[0] = contact.points[1] = (nearest.first + nearest.second) / 2;
  contact.normal = anyNormal(a, b);
  contact.depth = 0;
  return contact;
}

}  // namespace adaptive_bvh
