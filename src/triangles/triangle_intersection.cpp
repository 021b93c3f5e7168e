#include "triangles/triangle_intersection.h"

#include <algorithm>

#include "triangles/orientation.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

double largest(const Vector& v) { return v.lpNorm<Eigen::Infinity>(); }

/// A number with the sign of orientation(a, b, c, d). `determinant` is its rounded value, computed
/// from three differences, and `size` the product of their largest components.
double signOf(double determinant, double size, const Vector& a, const Vector& b, const Vector& c,
              const Vector& d) {
  return orientations::isCertain(determinant, size) ? determinant : exactOrientation(a, b, c, d);
}

/// The side of the plane of a face (a, b, c) on which each point x lies: the sign of det(b - a, c -
/// a, a - x), which equals that of orientation(a, b, c, x). The first two vectors are the same for
/// all points.
std::array<double, 3> sidesOf(const Triangle& face, const Triangle& points) {
  const Vector p = face[1] - face[0], q = face[2] - face[0], normal = p.cross(q);
  const double size = largest(p) * largest(q);
  std::array<double, 3> sides;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector r = face[0] - points[k];
    sides[k] = signOf(normal.dot(r), size * largest(r), face[0], face[1], face[2], points[k]);
  }
  return sides;
}

bool areInPlane(const std::array<double, 3>& sides) {
  return sides[0] == 0 && sides[1] == 0 && sides[2] == 0;
}

/// Whether the line through p and q intersects the face or its sides, provided that the line does
/// not lie in the face's plane. By the signs of det(q - p, y - p, x - p) for the sides from x to y.
bool passesThrough(const Vector& p, const Vector& q, const Triangle& face) {
  const Vector along = q - p, to[3] = {face[0] - p, face[1] - p, face[2] - p};
  const double length = largest(along), sizes[3] = {largest(to[0]), largest(to[1]), largest(to[2])};
  bool is_left = false, is_right = false;
  for (std::size_t k = 0; k < 3 && !(is_left && is_right); ++k) {
    const std::size_t next = (k + 1) % 3;
    const double side = signOf(along.dot(to[next].cross(to[k])), length * sizes[k] * sizes[next], p,
                               q, face[k], face[next]);
    is_left = is_left || side > 0;
    is_right = is_right || side < 0;
  }
  return is_left != is_right;
}

/// The parameter, 0 at p and 1 at q, at which a segment crosses the face's plane; p and q lie on
/// opposite sides. Computed without cancellation: for needles, double precision would leave hardly
/// a correct digit.
double planeShare(const Triangle& face, const Vector& p, const Vector& q) {
  ExactSum above, whole;
  addOrientation(above, face[0], face[1], face[2], p);
  addOrientation(whole, face[0], face[1], face[2], p);
  addOrientation(whole, face[1], face[0], face[2], q);  // minus the orientation of q
  return above.value() / whole.value();
}

/// Decides about points of one plane, in a projection along a coordinate axis across that plane.
class Projection {
 public:
  explicit Projection(int axis) : i_((axis + 1) % 3), j_((axis + 2) % 3) {}

  /// 1 if p, q, r are counter-clockwise in the projection, -1 if clockwise, 0 if collinear.
  int turn(const Vector& p, const Vector& q, const Vector& r) const {
    return planarOrientation(p[i_], p[j_], q[i_], q[j_], r[i_], r[j_]);
  }
  /// Whether the projected triangle has no area.
  bool isThin(const Triangle& t) const { return turn(t[0], t[1], t[2]) == 0; }

  /// Whether the segments from p to q and from r to s have a common point.
  bool segmentsMeet(const Vector& p, const Vector& q, const Vector& r, const Vector& s) const {
    const int at_r = turn(p, q, r), at_s = turn(p, q, s), at_p = turn(r, s, p),
              at_q = turn(r, s, q);
    if (at_r * at_s > 0 || at_p * at_q > 0) return false;
    if (at_r || at_s || at_p || at_q) return true;
    // All are collinear.
    return overlap(p[i_], q[i_], r[i_], s[i_]) && overlap(p[j_], q[j_], r[j_], s[j_]);
  }

  /// Whether a triangle, which is not thin in this projection, contains x.
  bool contains(const Triangle& t, const Vector& x) const {
    bool is_left = false, is_right = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const int side = turn(t[k], t[(k + 1) % 3], x);
      is_left = is_left || side > 0;
      is_right = is_right || side < 0;
    }
    return is_left != is_right;
  }

 private:
  /// Whether the intervals between p and q and between r and s overlap.
  static bool overlap(double p, double q, double r, double s) {
    return std::max(p, q) >= std::min(r, s) && std::max(r, s) >= std::min(p, q);
  }

  int i_, j_;  ///< the coordinates that remain
};

/// An axis along which the projected triangle is not thin; 3 if the triangle is a segment or a
/// point.
int axisAcross(const Triangle& t) {
  int axis = 0;
  while (axis < 3 && Projection(axis).isThin(t)) ++axis;
  return axis;
}

/// Whether two coplanar triangles intersect, projected along `axis`.
bool meetInPlane(const Triangle& a, const Triangle& b, int axis) {
  const Projection projection(axis);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (projection.segmentsMeet(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3])) return true;
  // If the boundaries do not intersect, one triangle may be inside the other.
  return (!projection.isThin(a) && projection.contains(a, b[0])) ||
         (!projection.isThin(b) && projection.contains(b, a[0]));
}

/// Whether two triangles that are both degenerate to segments or points intersect.
bool segmentsMeet(const Triangle& a, const Triangle& b) {
  const auto isBefore = [](const Vector& x, const Vector& y) {
    return std::lexicographical_compare(x.data(), x.data() + 3, y.data(), y.data() + 3);
  };
  // On a line, the lexicographical order is the order along the line.
  const auto [a_first, a_last] = std::minmax_element(a.begin(), a.end(), isBefore);
  const auto [b_first, b_last] = std::minmax_element(b.begin(), b.end(), isBefore);
  if (orientation(*a_first, *a_last, *b_first, *b_last) != 0) return false;
  // The plane of both segments, given by three ends that are not collinear.
  for (const Triangle& ends :
       {Triangle{*a_first, *a_last, *b_first}, Triangle{*a_first, *a_last, *b_last},
        Triangle{*b_first, *b_last, *a_first}, Triangle{*b_first, *b_last, *a_last}}) {
    const int axis = axisAcross(ends);
    if (axis < 3) return Projection(axis).segmentsMeet(*a_first, *a_last, *b_first, *b_last);
  }
  return !isBefore(*a_last, *b_first) && !isBefore(*b_last, *a_first);  // all are on one line
}

/// Whether triangles v a b and v c d, given by their vectors from the corner v, certainly have only
/// v in common: a plane through v is strictly between them. Its normal is the difference of their
/// directions; whatever that is, the signs decide. Their error: u = 2^-53 of each component of x,
/// of each product and of two sums, below 12.1 u of the product of the largest components.
bool certainlyPart(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  const auto scaled = [](const Vector& x) -> Vector { return x * (1 / largest(x)); };
  const Vector normal = scaled(scaled(a) + scaled(b)) - scaled(scaled(c) + scaled(d));
  const auto isBeyond = [&](const Vector& x) -> bool {  // false for NaN
    return orientations::isCertain(normal.dot(x), largest(normal) * largest(x));
  };
  return normal.dot(a) > 0 && normal.dot(b) > 0 && normal.dot(c) < 0 && normal.dot(d) < 0 &&
         isBeyond(a) && isBeyond(b) && isBeyond(c) && isBeyond(d);
}

/// Whether a and b, given by their vectors from the edge's first end, certainly are on different
/// sides of the edge `along` in a projection along a coordinate axis. Then triangles on this edge
/// have nothing else in common, in one plane or not.
bool certainlyAcross(const Vector& along, const Vector& a, const Vector& b) {
  const auto side = [&](const Vector& x, int i, int j) -> int {
    return orientations::certainSign(along[i] * x[j], along[j] * x[i]);
  };
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (side(a, i, j) * side(b, i, j) < 0) return true;
  }
  return false;
}

}  // namespace

TriangleIntersection::TriangleIntersection(const Triangle& a, const Triangle& b) : a_(a), b_(b) {
  const Sides sides_of_b = sidesOf(a, b);
  if (areOnOneSide(sides_of_b)) return;
  const Sides sides_of_a = sidesOf(b, a);
  if (areOnOneSide(sides_of_a)) return;
  if (findCrossing(a, b, sides_of_a) || findCrossing(b, a, sides_of_b)) return;
  const bool b_in_plane = areInPlane(sides_of_b), a_in_plane = areInPlane(sides_of_a);
  if (!a_in_plane && !b_in_plane) return;
  // A segment or a point has no plane: every point would count as lying in it.
  if (const int axis = axisAcross(a); axis < 3)
    is_in_plane_ = b_in_plane && meetInPlane(a, b, axis);
  else if (const int other_axis = axisAcross(b); other_axis < 3)
    is_in_plane_ = a_in_plane && meetInPlane(a, b, other_axis);
  else
    is_in_plane_ = segmentsMeet(a, b);
}

bool TriangleIntersection::findCrossing(const Triangle& edges, const Triangle& face,
                                        const Sides& sides) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const bool is_on_one_side = (sides[k] > 0) == (sides[next] > 0) &&
                                (sides[k] < 0) == (sides[next] < 0);  // or lies in the plane
    if (is_on_one_side || !passesThrough(edges[k], edges[next], face)) continue;
    edges_ = &edges;
    edge_ = k;
    return true;
  }
  return false;
}

PointPair TriangleIntersection::crossing() const {
  const Triangle& face = edges_ == &a_ ? b_ : a_;
  const Vector &p = (*edges_)[edge_], &q = (*edges_)[(edge_ + 1) % 3];
  const Vector on_edge = p + planeShare(face, p, q) * (q - p),
               on_face = nearestPoint(face, on_edge);
  return edges_ == &a_ ? PointPair{on_edge, on_face} : PointPair{on_face, on_edge};
}

/// One shared corner v, triangles v a b and v c d: their intersection is convex. A ray from v
/// through another common point leaves one of the triangles first, through the side opposite to v.
/// So they have another common point if and only if the segment a b intersects v c d, or c d
/// intersects v a b.
///
/// Two shared corners u and v, with the other corners a and b: if the planes differ, they have only
/// the line u v in common. In one plane, the triangles overlap beyond that line if and only if a
/// and b are on the same side of it.
bool meetBeyondShared(const Triangle& p, const std::array<unsigned, 3>& of_p, const Triangle& q,
                      const std::array<unsigned, 3>& of_q) {
  std::size_t shared[3] = {0, 0, 0}, num_shared = 0;     // corners of p that are shared
  std::size_t own_p[3], own_q[3], num_p = 0, num_q = 0;  // corners that are not shared
  for (std::size_t i = 0; i < 3; ++i) {
    const bool is_shared = of_p[i] == of_q[0] || of_p[i] == of_q[1] || of_p[i] == of_q[2];
    if (is_shared)
      shared[num_shared++] = i;
    else
      own_p[num_p++] = i;
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (of_q[i] != of_p[0] && of_q[i] != of_p[1] && of_q[i] != of_p[2]) own_q[num_q++] = i;
  if (num_shared == 0) return touch(p, q);
  const Vector& u = p[shared[0]];
  if (num_shared == 1 && num_q == 2 &&
      certainlyPart(p[own_p[0]] - u, p[own_p[1]] - u, q[own_q[0]] - u, q[own_q[1]] - u))
    return false;
  if (num_shared == 2 && num_q == 1 &&
      certainlyAcross(p[shared[1]] - u, p[own_p[0]] - u, q[own_q[0]] - u))
    return false;
  if (axisAcross(p) == 3 || axisAcross(q) == 3) return false;
  if (num_shared == 3) return true;
  if (num_shared == 2) {
    const Vector &v = p[shared[1]], &a = p[own_p[0]], &b = q[own_q[0]];
    if (orientation(u, v, a, b) != 0) return false;
    for (int k = 0; k < 3; ++k)
      if (Projection(k).turn(u, v, a) * Projection(k).turn(u, v, b) > 0) return true;
    return false;
  }
  // The triangle comes first: mostly both ends of the segment are on one side of its plane.
  return touch(q, {p[own_p[0]], p[own_p[1]], p[own_p[1]]}) ||
         touch(p, {q[own_q[0]], q[own_q[1]], q[own_q[1]]});
}

}  // namespace adaptive_bvh
