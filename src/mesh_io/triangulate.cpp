#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>

#include "scene.h"

namespace adaptive_bvh {
namespace {

/// A point of the plane.
struct PlanarPoint {
  double x, y;
};

bool operator==(const PlanarPoint& a, const PlanarPoint& b) { return a.x == b.x && a.y == b.y; }

/// The sum of a few products, exact: numbers that do not overlap, the largest last (an "expansion"
/// of J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
/// predicates", 1997).
class ExpansionSum {
 public:
  void addProduct(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }

  int sign() const {
    for (std::size_t k = size_; k-- > 0;)
      if (terms_[k] != 0) return terms_[k] > 0 ? 1 : -1;
    return 0;
  }

 private:
  void add(double number) {
    for (std::size_t k = 0; k < size_; ++k) {  // Knuth's TwoSum with each term
      const double sum = number + terms_[k], other = sum - number;
      terms_[k] = (number - (sum - other)) + (terms_[k] - other);
      number = sum;
    }
    terms_[size_++] = number;
  }

  std::array<double, 12> terms_;
  std::size_t size_ = 0;
};

/// 1 where three points are counter-clockwise, -1 where they are clockwise, 0 on one line. Exact
/// for coordinates of at most 1 whose products do not underflow.
int planarOrientation(const PlanarPoint& a, const PlanarPoint& b, const PlanarPoint& c) {
  const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
  const double determinant = left - right, size = std::fabs(left) + std::fabs(right);
  // The paper has (3 + 16 u) u times the size, with u = 2^-53.
  if (size > 0x1p-900 && std::fabs(determinant) > 0x1p-51 * size) return determinant > 0 ? 1 : -1;
  ExpansionSum sum;
  sum.addProduct(a.x, b.y);
  sum.addProduct(-a.x, c.y);
  sum.addProduct(-c.x, b.y);
  sum.addProduct(-a.y, b.x);
  sum.addProduct(a.y, c.x);
  sum.addProduct(c.y, b.x);
  return sum.sign();
}

/// Three corners of a polygon, by number.
using Ear = std::array<std::size_t, 3>;
using PlanarTriangle = std::array<PlanarPoint, 3>;

/// Whether x lies on the segment from a to b, ends excluded.
bool isWithinSegment(const PlanarPoint& a, const PlanarPoint& b, const PlanarPoint& x) {
  const auto isBetween = [](double from, double to, double at) {
    return std::min(from, to) < at && at < std::max(from, to);
  };
  return (a.x == b.x ? isBetween(a.y, b.y, x.y) : isBetween(a.x, b.x, x.x)) &&
         planarOrientation(a, b, x) == 0;
}

/// Whether two of a triangle's coordinates, of which there are three, leave a segment outside.
bool areOnOneSide(double a, double b, double c, double from, double to) {
  return std::max(from, to) <= std::min({a, b, c}) || std::min(from, to) >= std::max({a, b, c});
}

/// Whether a segment has a point inside of a counter-clockwise triangle: no edge of the triangle,
/// nor the segment itself, separates them.
bool enters(const PlanarPoint& from, const PlanarPoint& to, const PlanarTriangle& t) {
  if (areOnOneSide(t[0].x, t[1].x, t[2].x, from.x, to.x) ||
      areOnOneSide(t[0].y, t[1].y, t[2].y, from.y, to.y))
    return false;
  int left = 0, right = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const PlanarPoint &a = t[k], &b = t[(k + 1) % 3];
    if (planarOrientation(a, b, from) <= 0 && planarOrientation(a, b, to) <= 0) return false;
    const int side = planarOrientation(from, to, a);
    left += side > 0;
    right += side < 0;
  }
  return left > 0 && right > 0;
}

/// Whether an edge of the first triangle has the second one on its outer side.
bool hasSeparatingEdge(const PlanarTriangle& triangle, const PlanarTriangle& other) {
  for (std::size_t k = 0; k < 3; ++k)
    if (std::all_of(other.begin(), other.end(), [&](const PlanarPoint& p) {
          return planarOrientation(triangle[k], triangle[(k + 1) % 3], p) <= 0;
        }))
      return true;
  return false;
}

/// Cuts corners off a polygon until nothing is left. Every cut is a counter-clockwise triangle that
/// no part of the outline enters, so that a corner which can be cut off stays one that can; a
/// corner is looked at again when a neighbour is gone.
class EarClipping {
 public:
  /// False where there are no such triangles. `points` are counter-clockwise.
  bool run(const std::vector<PlanarPoint>& points, std::vector<Ear>& ears) {
    points_ = &points;
    start();
    removeAll([this](std::size_t v) { return isSuperfluous(v); });
    ears.clear();
    removeAll([&](std::size_t v) {
      if (isSuperfluous(v)) return true;
      if (!isEar(v)) return false;
      ears.push_back({previous_[v], v, next_[v]});
      std::rotate(ears.back().begin(), std::min_element(ears.back().begin(), ears.back().end()),
                  ears.back().end());
      return true;
    });
    return left_ <= 2;
  }

 private:
  void start() {
    left_ = points_->size();
    next_.resize(left_);
    previous_.resize(left_);
    for (std::size_t v = 0; v < left_; ++v) {
      next_[v] = (v + 1) % left_;
      previous_[next_[v]] = v;
    }
  }

  /// Removes corners while `isRemovable` says so. Every other one comes first, which keeps the
  /// triangles of round polygons wide.
  template <typename Predicate>
  void removeAll(const Predicate& isRemovable) {
    pending_.clear();
    for (const std::size_t first : {1, 0})
      for (std::size_t v = first; v < points_->size(); v += 2)
        if (isLeft(v)) pending_.push_back(v);
    for (std::size_t i = 0; i < pending_.size() && left_ > 2; ++i) {
      const std::size_t v = pending_[i];
      if (!isLeft(v) || !isRemovable(v)) continue;
      pending_.insert(pending_.end(), {previous_[v], next_[v]});
      remove(v);
    }
  }

  bool isLeft(std::size_t v) const { return next_[v] != v; }
  void remove(std::size_t v) {
    next_[previous_[v]] = next_[v];
    previous_[next_[v]] = previous_[v];
    next_[v] = v;
    --left_;
  }

  const PlanarPoint& point(std::size_t v) const { return (*points_)[v]; }

  /// Where the outline repeats a point, or turns straight back.
  bool isSuperfluous(std::size_t v) const {
    const PlanarPoint &u = point(previous_[v]), &p = point(v), &w = point(next_[v]);
    if (u == p || u == w) return true;
    if (planarOrientation(u, p, w) != 0) return false;
    return u.x != p.x ? (u.x < p.x) == (w.x < p.x) && w.x != p.x
                      : (u.y < p.y) == (w.y < p.y) && w.y != p.y;
  }

  bool isEar(std::size_t v) const {
    const std::size_t u = previous_[v], w = next_[v];
    const PlanarTriangle triangle = {point(u), point(v), point(w)};
    if (planarOrientation(triangle[0], triangle[1], triangle[2]) <= 0) return false;
    for (std::size_t a = w; a != u; a = next_[a])
      if (isWithinSegment(triangle[0], triangle[2], point(a)) ||
          enters(point(a), point(next_[a]), triangle))
        return false;
    return true;
  }

  const std::vector<PlanarPoint>* points_ = nullptr;
  std::size_t left_ = 0;
  std::vector<std::size_t> next_, previous_;  ///< of the corners that are left
  std::vector<std::size_t> pending_;
};

/// Triangulates polygons one after another, in memory that it keeps.
class Triangulation {
 public:
  /// False where there is none.
  bool run(const std::vector<fcl::Vector3d>& corners) {
    const int axis = axisOf(corners);
    for (int k = axis; k < axis + 3; ++k) {
      const int x = (k + 1) % 3, y = (k + 2) % 3;
      if (!runIn(corners, x, y) && !runIn(corners, y, x)) return false;
      if (!ears_.empty()) return true;
    }
    return true;  // without area, however it is seen
  }
  const std::vector<Ear>& ears() const { return ears_; }

 private:
  /// The axis along which the normal is largest. Differences are taken from the first corner: few
  /// digits are lost far from the origin.
  static int axisOf(const std::vector<fcl::Vector3d>& corners) {
    fcl::Vector3d normal = fcl::Vector3d::Zero();
    double size = 0;
    for (const fcl::Vector3d& p : corners)
      size = std::max(size, (p - corners[0]).lpNorm<Eigen::Infinity>());
    for (std::size_t k = 1; k + 1 < corners.size() && size > 0; ++k)
      normal += ((corners[k] - corners[0]) / size).cross((corners[k + 1] - corners[0]) / size);
    int axis;
    normal.cwiseAbs().maxCoeff(&axis);
    return axis;
  }

  bool runIn(const std::vector<fcl::Vector3d>& corners, int x, int y) {
    double size = 0;
    for (const fcl::Vector3d& p : corners)
      size = std::max({size, std::fabs(p[x]), std::fabs(p[y])});
    int exponent;
    std::frexp(size, &exponent);
    points_.clear();
    for (const fcl::Vector3d& p : corners)
      points_.push_back({std::ldexp(p[x], -exponent), std::ldexp(p[y], -exponent)});
    return clipping_.run(points_, ears_) && isWithoutOverlap();
  }

  PlanarTriangle triangleOf(const Ear& ear) const {
    return {points_[ear[0]], points_[ear[1]], points_[ear[2]]};
  }

  /// The triangles add up to the outline: each point is in as many of them as the outline runs
  /// around it. Where that is more than once, two triangles overlap.
  bool isWithoutOverlap() {
    spans_.clear();
    for (const Ear& ear : ears_) {
      const PlanarTriangle t = triangleOf(ear);
      const auto [least, most] = std::minmax({t[0].x, t[1].x, t[2].x});
      spans_.push_back({least, most, t});
    }
    std::sort(spans_.begin(), spans_.end(),
              [](const Span& a, const Span& b) { return a.least < b.least; });
    for (auto one = spans_.begin(); one != spans_.end(); ++one)
      for (auto two = one + 1; two != spans_.end() && two->least < one->most; ++two)
        if (!hasSeparatingEdge(one->triangle, two->triangle) &&
            !hasSeparatingEdge(two->triangle, one->triangle))
          return false;
    return true;
  }

  struct Span {
    double least, most;  ///< of x
    PlanarTriangle triangle;
  };

  EarClipping clipping_;
  std::vector<PlanarPoint> points_;
  std::vector<Ear> ears_;
  std::vector<Span> spans_;
};

[[noreturn]] void refuseFace(std::size_t face, const std::string& reason) {
  throw std::runtime_error("face " + std::to_string(face + 1) + ' ' + reason);
}

}  // namespace

TriangleMesh<double> triangulate(PolygonMesh mesh) {
  TriangleMesh<double> result;
  result.vertices = std::move(mesh.vertices);
  Triangulation triangulation;
  std::vector<fcl::Vector3d> points;
  const std::size_t* corner = mesh.corners.data();
  for (std::size_t face = 0; face < mesh.sizes.size(); corner += mesh.sizes[face++]) {
    const std::size_t size = mesh.sizes[face];
    for (std::size_t k = 0; k < size; ++k)
      if (corner[k] >= result.vertices.size())
        refuseFace(face, "names vertex " + std::to_string(corner[k]) + " of " +
                             std::to_string(result.vertices.size()));
    if (size == 3) result.triangles.emplace_back(corner[0], corner[1], corner[2]);
    if (size <= 3) continue;
    if (size > kMostCorners)
      refuseFace(face, "has more than " + std::to_string(kMostCorners) + " corners");
    points.clear();
    for (std::size_t k = 0; k < size; ++k) points.push_back(result.vertices[corner[k]]);
    if (!std::all_of(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); }))
      refuseFace(face, "has a corner that is not finite");
    if (!triangulation.run(points))
      refuseFace(face,
                 "of " + std::to_string(size) +
                     " corners crosses itself, or touches itself so that no triangles fill it");
    for (const Ear& ear : triangulation.ears())
      result.triangles.emplace_back(corner[ear[0]], corner[ear[1]], corner[ear[2]]);
  }
  return result;
}

}  // namespace adaptive_bvh
