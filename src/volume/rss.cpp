#include "volume/rss.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Eigenvalues>

namespace adaptive_bvh {
namespace {

template <typename S>
using Vector3 = fcl::Vector3<S>;
template <typename S>
using Matrix3 = fcl::Matrix3<S>;

/// A right-handed orthonormal frame whose first axis lies along a and whose second lies in the
/// plane of a and b. Any frame where a or b leaves the choice open.
template <typename S>
Matrix3<S> frameAlong(const Vector3<S>& a, const Vector3<S>& b) {
  const S tiny = std::numeric_limits<S>::min();
  Vector3<S> x = a;
  const S a_length = a.norm();
  if (a_length > tiny)
    x /= a_length;
  else
    x = Vector3<S>::UnitX();

  Vector3<S> y = b - x * x.dot(b);
  // What is left of b must stand clear of its rounding error, or its direction is noise.
  if (y.norm() > 16 * rounding::epsilon<S>() * b.norm() && y.norm() > tiny)
    y.normalize();
  else
    y = x.unitOrthogonal();
  y -= x * x.dot(y);  // once more: the first difference may have cancelled
  y.normalize();

  Matrix3<S> frame;
  frame << x, y, x.cross(y);
  return frame;
}

/// The vector to p from a point of the rectangle, the nearest one up to rounding.
template <typename S>
Vector3<S> fromRectangle(const fcl::RSS<S>& bv, const Vector3<S>& p) {
  const Vector3<S> v = p - bv.To;
  const S x = std::min(std::max(bv.axis.col(0).dot(v), S(0)), bv.l[0]);
  const S y = std::min(std::max(bv.axis.col(1).dot(v), S(0)), bv.l[1]);
  return v - bv.axis.col(0) * x - bv.axis.col(1) * y;
}

/// The least radius, error included, with which the volume holds all points in exact arithmetic.
template <typename S, typename Points>
S radiusFor(const fcl::RSS<S>& bv, const Points& points) {
  S squared = 0;
  for (const Vector3<S>& p : points)
    squared = std::max(squared, fromRectangle(bv, p).squaredNorm());
  const S distance = std::sqrt(squared);
  return distance + Volume<fcl::RSS<S>>::containmentError(bv, distance);
}

/// One triangle: the rectangle on its longest edge, twice its area, the least any rectangle can do.
template <typename S>
fcl::RSS<S> fitTriangle(const Vector3<S>& p0, const Vector3<S>& p1, const Vector3<S>& p2) {
  const Vector3<S>* corner[3] = {&p0, &p1, &p2};
  const S edge[3] = {(p1 - p0).squaredNorm(), (p2 - p1).squaredNorm(), (p0 - p2).squaredNorm()};
  const int longest = static_cast<int>(std::max_element(edge, edge + 3) - edge);
  const Vector3<S>& base = *corner[longest];
  const Vector3<S> along = *corner[(longest + 1) % 3] - base;
  const Vector3<S> apex = *corner[(longest + 2) % 3] - base;

  fcl::RSS<S> bv;
  bv.axis = frameAlong<S>(along, apex);
  // The apex projects into the longest edge, but for rounding; `radiusFor` pays for that.
  bv.To = base;
  bv.l[0] = along.norm();
  bv.l[1] = std::max(S(0), bv.axis.col(1).dot(apex));
  bv.r = radiusFor(bv, std::array<Vector3<S>, 3>{p0, p1, p2});
  return bv;
}

/// The positions of a fit, gathered once: a fit walks them five times, and in the mesh they lie
/// apart. About six triangles share a vertex, so above a few triangles each vertex is taken once,
/// which is faster, and in the principal axes better than counting it for every triangle (queries
/// on the scenarios needed 5 % fewer volume tests).
///
/// The arrays grow to the largest fit that the thread has made, which is the first one of a build,
/// the root's; from then on nothing is allocated.
template <typename S>
class Gathered {
 public:
  const std::vector<Vector3<S>>& from(const MeshView<S>& mesh, const unsigned* primitives,
                                      int count) {
    constexpr int kOnceFrom = 8;
    const bool once = count >= kOnceFrom && mesh.triangles;
    points_.clear();
    ++fit_;
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < mesh.verticesPerPrimitive(); ++k) {
        const unsigned v = mesh.vertex(primitives[i], k);
        if (!once || isNew(v))
          mesh.forEachPositionOf(v, [this](const Vector3<S>& p) { points_.push_back(p); });
      }
    return points_;
  }

 private:
  bool isNew(unsigned v) {
    if (v >= taken_in_.size()) taken_in_.resize(v + v / 2 + 1, 0);
    if (taken_in_[v] == fit_) return false;
    taken_in_[v] = fit_;
    return true;
  }

  std::vector<Vector3<S>> points_;
  std::vector<std::uint64_t> taken_in_;  // by vertex: the last fit that took it
  std::uint64_t fit_ = 0;
};

/// Principal axes, largest variance first. Moments are taken about one of the points, so that a
/// far-off mesh loses no digits. Errors here cost tightness, never containment.
template <typename S>
Matrix3<S> principalAxes(const std::vector<Vector3<S>>& points) {
  Vector3<S> sum = Vector3<S>::Zero();
  Matrix3<S> products = Matrix3<S>::Zero();
  for (const Vector3<S>& p : points) {
    const Vector3<S> q = p - points.front();
    sum += q;
    products.noalias() += q * q.transpose();
  }
  const S n = static_cast<S>(points.size());
  const Matrix3<S> covariance = products / n - (sum / n) * (sum / n).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3<S>> eigen(covariance);
  return frameAlong<S>(eigen.eigenvectors().col(2), eigen.eigenvectors().col(1));
}

template <typename S>
struct Interval {
  S low = std::numeric_limits<S>::max();
  S high = std::numeric_limits<S>::lowest();

  void add(S low_value, S high_value) {
    low = std::min(low, low_value);
    high = std::max(high, high_value);
  }
  /// An empty interval becomes its middle: every ball then reaches the point from both sides.
  void close() {
    if (low > high) low = high = (low + high) / 2;
  }
  /// How far x lies beyond the nearer end; negative inside.
  S beyond(S x) const { return std::max(low - x, x - high); }
  void grow(S x, S by) { (x < low ? low -= by : high += by); }
};

/// Many points, after Larsen et al. (1999), PQP: the sphere radius is half the thickness along the
/// normal. In the plane, a point at height z is reached over w = sqrt(r^2 - z^2), so the rectangle
/// ends w short of it. Points beyond two sides at once may lie outside the round corner: there both
/// sides grow by the least equal step that reaches the point.
template <typename S>
fcl::RSS<S> fitPositions(const std::vector<Vector3<S>>& points) {
  fcl::RSS<S> bv;
  const Vector3<S> origin = points.front();
  bv.axis = principalAxes(points);
  const auto local = [&](const Vector3<S>& p) -> Vector3<S> {
    return bv.axis.transpose() * (p - origin);
  };

  Interval<S> z;
  for (const Vector3<S>& p : points) {
    const S height = bv.axis.col(2).dot(p - origin);
    z.add(height, height);
  }
  const S middle = (z.low + z.high) / 2;
  const S r = (z.high - z.low) / 2;
  const auto squaredReach = [&](S height) {
    return std::max(S(0), r * r - (height - middle) * (height - middle));
  };

  Interval<S> x, y;
  for (const Vector3<S>& p : points) {
    const Vector3<S> q = local(p);
    if (x.beyond(q[0]) <= 0 && y.beyond(q[1]) <= 0) continue;  // as w >= 0, no end moves
    const S w = std::sqrt(squaredReach(q[2]));
    x.add(q[0] + w, q[0] - w);
    y.add(q[1] + w, q[1] - w);
  }
  x.close();
  y.close();

  for (const Vector3<S>& p : points) {
    const Vector3<S> q = local(p);
    const S dx = x.beyond(q[0]);
    const S dy = y.beyond(q[1]);
    if (dx <= 0 || dy <= 0) continue;
    const S w2 = squaredReach(q[2]);
    if (dx * dx + dy * dy <= w2) continue;
    // The smaller root g of (dx - g)^2 + (dy - g)^2 = w^2.
    const S step = (dx + dy - std::sqrt(std::max(S(0), 2 * w2 - (dx - dy) * (dx - dy)))) / 2;
    x.grow(q[0], step);
    y.grow(q[1], step);
  }

  bv.To = origin + bv.axis * Vector3<S>(x.low, y.low, middle);
  bv.l[0] = x.high - x.low;
  bv.l[1] = y.high - y.low;
  bv.r = radiusFor(bv, points);
  return bv;
}

}  // namespace

template <typename S>
S Volume<fcl::RSS<S>>::size(const BV& bv, S radius) {
  const S length = radius + std::min(bv.l[0], bv.l[1]) / 2;
  return length > 0 ? length : std::max(bv.l[0], bv.l[1]);
}

template <typename S>
S Volume<fcl::RSS<S>>::distanceToRectangle(const BV& bv, const Point& p) {
  return fromRectangle(bv, p).norm();
}

// Any x in [0, l0] and y in [0, l1] name a point q of the rectangle, so |p - q| bounds the distance
// whatever the rounding of x and y. Let w = p - To - a0 x - a1 y exactly. A component of the
// computed w is off by at most 3u (|v_i| + |a0_i x| + |a1_i y|), hence the vector by
// 3u (|v| + 1.01 (x + y)) <= 3u |w| + 6.1u (l0 + l1), with |v| <= |w| + 1.01 (x + y) and axes of
// length at most 1.01. The norm adds 3u and underflow adds tiny. So the exact distance is at most
// d (1 + 6u) + 6.2u (l0 + l1) + tiny; the bound below is twice that, which also covers its own
// evaluation, the caller's sum, and a distance taken as the upper end.
template <typename S>
S Volume<fcl::RSS<S>>::containmentError(const BV& bv, S distance) {
  return 6 * rounding::epsilon<S>() * (distance + bv.l[0] + bv.l[1]) + rounding::tiny<S>();
}

template <typename S>
fcl::RSS<S> Volume<fcl::RSS<S>>::fit(const MeshView<S>& mesh, const unsigned* primitives,
                                     int count) {
  if (count == 1 && mesh.triangles && !mesh.previous) {
    const fcl::Triangle& t = mesh.triangles[primitives[0]];
    return fitTriangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  }
  static thread_local Gathered<S> gathered;
  return fitPositions(gathered.from(mesh, primitives, count));
}

template struct Volume<fcl::RSS<float>>;
template struct Volume<fcl::RSS<double>>;

}  // namespace adaptive_bvh
