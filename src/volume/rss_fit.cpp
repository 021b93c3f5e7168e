#include "volume/rss_fit.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Eigenvalues>

#include "volume/rss.h"
#include "volume/swept_rectangle.h"

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

/// The least radius, error included, with which the volume holds all points in exact arithmetic.
template <typename S, typename Points>
S radiusFor(const fcl::RSS<S>& bv, const Points& points) {
  S squared = 0;
  for (const Vector3<S>& p : points)
    squared = std::max(squared, vectorFromRectangle(bv, p).squaredNorm());
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

template <typename S>
Corners cornersOf(const MeshView<S>& mesh, unsigned primitive) {
  return mesh.corners(primitive);
}
template <typename S>
const Corners& cornersOf(const MeshView<S>&, const Corners& primitive) {
  return primitive;
}

/// The positions of a fit, gathered once: a fit walks them five times, and in the mesh they lie
/// apart. Each vertex is taken once, though about six triangles share it: that is faster, and in
/// the principal axes better than counting it for every triangle (queries on the scenarios needed 5
/// % fewer volume tests).
///
/// The arrays grow to the largest fit that the thread has made, which is the first one of a build,
/// the root's; from then on nothing is allocated.
template <typename S>
class Gathered {
 public:
  template <typename Primitive>
  const std::vector<Vector3<S>>& from(const MeshView<S>& mesh, const Primitive* primitives,
                                      int count) {
    points_.clear();
    ++fit_;
    for (int i = 0; i < count; ++i)
      for (unsigned v : cornersOf(mesh, primitives[i]))
        if (isNew(v))
          mesh.forEachPositionOf(v, [this](const Vector3<S>& p) { points_.push_back(p); });
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
  Matrix3<S> covariance = products / n - (sum / n) * (sum / n).transpose();
  const S size = covariance.diagonal().maxCoeff();
  if (size > std::numeric_limits<S>::min()) covariance /= size;  // squares of its numbers follow
  Eigen::SelfAdjointEigenSolver<Matrix3<S>> eigen;
  eigen.computeDirect(covariance);
  // The closed form is quick and a little inexact. One step of power iteration mends what matters:
  // of a flat set, the normal.
  return frameAlong<S>(covariance * eigen.eigenvectors().col(2),
                       covariance * eigen.eigenvectors().col(1));
}

/// A choice of sides and sphere, with what they need around some points.
template <typename S>
struct Shape {
  Direction<S> side;
  Slab<S> slab;
  Rectangle<S> rectangle;
  S area = std::numeric_limits<S>::infinity();
};

/// Keeps the best of the shapes with a given side. A sphere of half the thickness is the least that
/// will do, but not always the best: over a dome, a larger one lets the rectangle end far within
/// the rim. Returns false for a set so flat that this cannot matter.
template <typename S>
bool improve(Shape<S>& best, LocalPoints<S>& points, const Direction<S>& side) {
  points.turn(side.x, side.y);
  const Interval<S> z = extent<S>(points.z());
  const S middle = (z.low + z.high) / 2, half = z.length() / 2;
  const auto attempt = [&](const Slab<S>& slab) {
    const Rectangle<S> rectangle = rectangleFor(points, slab);
    const S area = rectangle.sweptArea(slab.radius);
    if (area < best.area) best = {side, slab, rectangle, area};
    return rectangle;
  };
  const Rectangle<S> least = attempt({middle, half});
  const bool thick = half > S(0.1) * (least.x.length() + least.y.length());
  if (thick)
    for (S shift : {-half / 2, half / 2}) attempt({middle + shift, S(1.5) * half});
  points.turn(side.x, -side.y);
  return thick;
}

/// The normal is the direction of least variance. Which sides and which sphere suit it best is
/// judged on a few points, evenly picked; then all of them are enclosed.
template <typename S>
fcl::RSS<S> fitPositions(const std::vector<Vector3<S>>& points) {
  constexpr std::size_t kJudges = 64;
  static thread_local LocalPoints<S> local;
  const Matrix3<S> axes = principalAxes(points);
  local.assign(points, axes, (points.size() + kJudges - 1) / kJudges);
  Shape<S> shape;
  if (improve(shape, local, bestDirection(local))) improve(shape, local, Direction<S>());

  fcl::RSS<S> bv;
  const auto& [x, y] = shape.side;
  bv.axis << axes.col(0) * x + axes.col(1) * y, axes.col(1) * x - axes.col(0) * y, axes.col(2);
  if (local.size() < points.size()) {
    local.assign(points, bv.axis);
    const Interval<S> z = extent<S>(local.z());
    Slab<S>& slab = shape.slab;
    slab.radius = std::max({slab.radius, z.high - slab.middle, slab.middle - z.low});
    shape.rectangle = rectangleFor(local, slab);
  }
  const auto& [along, across] = shape.rectangle;
  bv.To = points.front() + bv.axis * Vector3<S>(along.low, across.low, shape.slab.middle);
  bv.l[0] = along.length();
  bv.l[1] = across.length();
  bv.r = radiusFor(bv, points);
  return bv;
}

}  // namespace

template <typename S, typename Primitive>
fcl::RSS<S> fitRss(const MeshView<S>& mesh, const Primitive* primitives, int count) {
  if (count == 1 && mesh.triangles && !mesh.previous) {
    const Corners& t = cornersOf(mesh, primitives[0]);
    return fitTriangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  }
  static thread_local Gathered<S> gathered;
  return fitPositions(gathered.from(mesh, primitives, count));
}

template fcl::RSS<float> fitRss(const MeshView<float>&, const unsigned*, int);
template fcl::RSS<float> fitRss(const MeshView<float>&, const Corners*, int);
template fcl::RSS<double> fitRss(const MeshView<double>&, const unsigned*, int);
template fcl::RSS<double> fitRss(const MeshView<double>&, const Corners*, int);

}  // namespace adaptive_bvh
