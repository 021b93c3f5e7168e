#include "triangles/convex_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "triangles/feature_distance.h"
#include "triangles/orientation.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints<double>;

/// A point of the difference of both sets, triangle minus convex set, and where it comes from.
struct Difference {
  Vector at, on_triangle, on_set;
};

/// The difference of a triangle and a convex set: it holds the origin where they touch.
class DifferenceSet {
 public:
  DifferenceSet(const Triangle& triangle, const ConvexSet& set) : triangle_(triangle), set_(set) {}

  Difference support(const Vector& direction) const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (direction.dot(triangle_[k]) > direction.dot(triangle_[best])) best = k;
    const Vector on_set = set_.support(-direction);
    return {triangle_[best] - on_set, triangle_[best], on_set};
  }

  /// The largest component of a coordinate of either, from the first corner on.
  double extent() const {
    double extent = 0;
    for (int k = 0; k < 3; ++k) {
      for (const Vector& corner : triangle_)
        extent = std::max(extent, std::fabs(corner[k] - triangle_[0][k]));
      for (const double side : {-1., 1.})
        extent =
            std::max(extent, std::fabs(set_.support(side * Vector::Unit(k))[k] - triangle_[0][k]));
    }
    return extent;
  }

 private:
  const Triangle& triangle_;
  const ConvexSet& set_;
};

/// Up to four points of a difference, and the point of their hull that is nearest to the origin.
class Simplex {
 public:
  void add(const Difference& point) { corners_[count_++] = point; }
  bool has(const Difference& point) const {
    return std::any_of(corners_, corners_ + count_,
                       [&](const Difference& corner) { return corner.at == point.at; });
  }

  /// Finds the nearest point and keeps only the corners that it is made of.
  void reduce() {
    least_ = std::numeric_limits<double>::infinity();
    if (count_ == 4 && holdsOrigin()) return;
    for (std::size_t i = 0; i < count_; ++i) {
      consider({i}, {1});
      for (std::size_t j = 0; j < i; ++j) {
        considerEdge(i, j);
        for (std::size_t k = 0; k < j; ++k) considerFace(i, j, k);
      }
    }
    Difference kept[3];
    for (std::size_t k = 0; k < best_.count; ++k) kept[k] = corners_[best_.corners[k]];
    std::copy_n(kept, best_.count, corners_);
    count_ = best_.count;
    for (std::size_t k = 0; k < count_; ++k) best_.corners[k] = k;
  }

  double squaredNorm() const { return least_; }
  Vector nearest() const { return combine(&Difference::at); }
  PointPair<double> points() const {
    return {combine(&Difference::on_triangle), combine(&Difference::on_set)};
  }

 private:
  struct Combination {
    std::size_t count = 0, corners[4];
    double weights[4];
  };

  template <std::size_t kCount>
  void consider(const std::size_t (&corners)[kCount], const double (&weights)[kCount]) {
    Vector at = Vector::Zero();
    for (std::size_t k = 0; k < kCount; ++k) at += weights[k] * corners_[corners[k]].at;
    const double square = at.squaredNorm();
    if (!(square < least_)) return;
    least_ = square;
    best_.count = kCount;
    std::copy_n(corners, kCount, best_.corners);
    std::copy_n(weights, kCount, best_.weights);
  }
  void considerEdge(std::size_t i, std::size_t j) {
    const Vector& from = corners_[i].at;
    const double t = feature_distance::Edge<double>(corners_[j].at - from).coordinate(-from);
    if (t > 0 && t < 1) consider({i, j}, {1 - t, t});
  }
  /// Seen across the longest edge, as in feature_distance.h.
  void considerFace(std::size_t i, std::size_t j, std::size_t k) {
    const auto square = [&](std::size_t a, std::size_t b) {
      return (corners_[a].at - corners_[b].at).squaredNorm();
    };
    if (square(j, k) > square(i, j) && square(j, k) >= square(i, k)) return considerAcross(j, k, i);
    if (square(i, k) > square(i, j)) return considerAcross(i, k, j);
    considerAcross(i, j, k);
  }
  void considerAcross(std::size_t i, std::size_t j, std::size_t apex) {
    const Vector &from = corners_[i].at, to_apex = corners_[apex].at - from;
    const feature_distance::Edge<double> base(corners_[j].at - from);
    const Vector height = base.across(to_apex);
    const double share =
        -base.across(from).dot(height) * feature_distance::inverse(height.squaredNorm());
    const double along = base.coordinate(-from) - share * base.coordinate(to_apex);
    if (share > 0 && along > 0 && share + along < 1)
      consider({i, j, apex}, {1 - share - along, along, share});
  }
  /// By signs without error: where the tetrahedron is nearly flat, those of rounded volumes would
  /// be anything.
  bool holdsOrigin() {
    double volumes[4], sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto corner = [&](std::size_t i) -> const Vector& { return corners_[(k + i) % 4].at; };
      volumes[k] =
          (k % 2 ? -1 : 1) * orientation(corner(1), corner(2), corner(3), Vector(Vector::Zero()));
      sum += volumes[k];
    }
    for (const double volume : volumes)
      if (!((volume > 0 && sum > 0) || (volume < 0 && sum < 0))) return false;
    best_.count = 4;
    for (std::size_t k = 0; k < 4; ++k) {
      best_.corners[k] = k;
      best_.weights[k] = volumes[k] / sum;
    }
    least_ = 0;
    return true;
  }
  Vector combine(Vector Difference::*part) const {
    Vector sum = Vector::Zero();
    for (std::size_t k = 0; k < best_.count; ++k)
      sum += best_.weights[k] * corners_[best_.corners[k]].*part;
    return sum;
  }

  Difference corners_[4];
  std::size_t count_ = 0;
  double least_ = std::numeric_limits<double>::infinity();
  Combination best_;
};

}  // namespace

ConvexGap convexGap(const Triangle& triangle, const ConvexSet& set, double error, int most_steps) {
  constexpr double kTouching = 0x1p-46;
  const DifferenceSet differences(triangle, set);
  const double extent = differences.extent();
  const double touching = kTouching * extent;
  Simplex simplex;
  simplex.add(differences.support(Vector::UnitX()));
  simplex.reduce();
  double lower = 0;
  for (int step = 0; step < most_steps; ++step) {
    const Vector nearest = simplex.nearest();
    const double length = nearest.norm();
    if (length <= touching || simplex.squaredNorm() == 0) return {simplex.points(), 0, 0};
    const Difference next = differences.support(-nearest / length);
    lower = std::max(lower, nearest.dot(next.at) / length);
    if (length - lower <= error * extent || simplex.has(next)) break;
    Simplex larger = simplex;
    larger.add(next);
    larger.reduce();
    if (!(larger.squaredNorm() < simplex.squaredNorm())) break;
    simplex = larger;
  }
  const double distance = std::sqrt(simplex.squaredNorm());
  return {simplex.points(), distance, distance - lower};
}

namespace {

/// A polytope inside of a difference, which grows where its surface is nearest to the origin.
class ExpandingPolytope {
 public:
  explicit ExpandingPolytope(const DifferenceSet& differences)
      : differences_(differences), extent_(differences.extent()) {}

  Penetration find() {
    if (!start()) return best_;
    for (int step = 0; step < kMostSteps; ++step) {
      const auto nearest =
          std::min_element(faces_.begin(), faces_.end(),
                           [](const Face& a, const Face& b) { return a.offset < b.offset; });
      const Vector top = measure(nearest->normal);
      best_.error = best_.depth - nearest->offset;
      if (best_.error <= kError * extent_ || !grow(std::size_t(nearest - faces_.begin()), top))
        break;
    }
    best_.depth = std::max(best_.depth, 0.);
    return best_;
  }

 private:
  static constexpr double kError = 1e-10;
  static constexpr int kMostSteps = 300;

  using Edge = std::pair<std::size_t, std::size_t>;
  struct Face {
    std::size_t corners[3];
    Vector normal;  ///< outward
    double offset;  ///< of its plane from the origin

    Edge edge(std::size_t k) const { return {corners[k], corners[(k + 1) % 3]}; }
    bool has(const Edge& other) const {
      return edge(0) == other || edge(1) == other || edge(2) == other;
    }
  };

  /// Asks how far the difference reaches along a direction of length 1: no shorter motion along it
  /// separates the two.
  Vector measure(const Vector& direction) {
    const Vector top = differences_.support(direction).at;
    const double reach = direction.dot(top);
    if (reach < best_.depth) best_ = {direction, reach, reach};
    return top;
  }

  /// A tetrahedron of far points. False where the difference is flat: then it touches, no more.
  bool start() {
    const Vector low = measure(-Vector::UnitX()), high = measure(Vector::UnitX());
    if (!((high - low).norm() > kError * extent_)) return false;
    const Vector along = (high - low).stableNormalized();
    const Vector across = farther([&](const Vector& x) { return (x - low).cross(along).norm(); },
                                  along.unitOrthogonal(), along);
    const Vector normal = (high - low).cross(across - low).stableNormalized();
    const Vector up = measure(normal), down = measure(-normal);
    const Vector top =
        std::fabs(normal.dot(up - low)) > std::fabs(normal.dot(down - low)) ? up : down;
    corners_ = {low, high, across, top};
    if (!(std::fabs(normal.dot(top - low)) > kError * extent_)) return false;
    const bool is_below = normal.dot(top - low) < 0;
    if (is_below) std::swap(corners_[0], corners_[1]);
    addFace(0, 2, 1);
    addFace(0, 1, 3);
    addFace(1, 2, 3);
    addFace(2, 0, 3);
    return true;
  }
  /// Of four points around a line, the farthest by `distance`.
  template <typename Distance>
  Vector farther(const Distance& distance, const Vector& first, const Vector& along) {
    const Vector second = along.cross(first);
    Vector best = measure(first);
    for (const Vector& direction : {Vector(-first), second, Vector(-second)}) {
      const Vector x = measure(direction);
      if (distance(x) > distance(best)) best = x;
    }
    return best;
  }

  void addFace(std::size_t a, std::size_t b, std::size_t c) {
    const Vector normal =
        (corners_[b] - corners_[a]).cross(corners_[c] - corners_[a]).stableNormalized();
    // One without an area is never the nearest.
    const double offset =
        normal.isZero(0) ? std::numeric_limits<double>::infinity() : normal.dot(corners_[a]);
    faces_.push_back({{a, b, c}, normal, offset});
  }

  /// Replaces the faces around `nearest` that are visible from a new corner. Returns false if
  /// `nearest` is not visible. Only visible faces connected to it by edges are replaced: where
  /// faces are nearly coplanar, rounding makes scattered faces seem visible, and their number would
  /// grow.
  bool grow(std::size_t nearest, const Vector& top) {
    const double least = 1e-3 * kError * extent_;
    const auto isSeen = [&](const Face& face) {
      return face.normal.dot(top) - face.offset > least;
    };
    if (!isSeen(faces_[nearest])) return false;
    std::vector<Edge> horizon;
    take(nearest, horizon);
    for (std::size_t i = 0; i < faces_.size();) {
      const Face& face = faces_[i];
      const bool is_joined = std::any_of(horizon.begin(), horizon.end(), [&](const Edge& edge) {
        return face.has({edge.second, edge.first});
      });
      if (!is_joined || !isSeen(face)) {
        ++i;
        continue;
      }
      take(i, horizon);
      i = 0;
    }
    corners_.push_back(top);
    for (const auto& [from, to] : horizon) addFace(from, to, corners_.size() - 1);
    return true;
  }
  /// Removes a face, and changes the edge of the hole.
  void take(std::size_t face, std::vector<Edge>& horizon) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = faces_[face].edge(k);
      const auto back = std::find(horizon.begin(), horizon.end(), Edge(edge.second, edge.first));
      if (back == horizon.end())
        horizon.push_back(edge);
      else
        horizon.erase(back);
    }
    faces_[face] = faces_.back();
    faces_.pop_back();
  }

  const DifferenceSet& differences_;
  const double extent_;
  std::vector<Vector> corners_;
  std::vector<Face> faces_;
  Penetration best_{Vector::UnitX(), std::numeric_limits<double>::infinity(), 0};
};

}  // namespace

Penetration ConvexSet::penetration(const TrianglePoints<double>& triangle) const {
  return penetrationOf(triangle, *this);
}

Penetration penetrationOf(const Triangle& triangle, const ConvexSet& set) {
  const DifferenceSet differences(triangle, set);
  return ExpandingPolytope(differences).find();
}

}  // namespace adaptive_bvh
