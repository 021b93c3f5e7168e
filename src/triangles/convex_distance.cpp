#include "triangles/convex_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/pack.h"
#include "triangles/feature_distance.h"
#include "triangles/orientation.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// A point of the Minkowski difference of two sets: value = on_first - on_second.
struct Difference {
  Vector value, on_first, on_second;
};

/// A triangle as a convex set with a non-virtual support function.
class TriangleSet {
 public:
  explicit TriangleSet(const Triangle& triangle) : triangle_(triangle) {}
  ADAPTIVE_BVH_INLINE Vector support(const Vector& direction) const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (direction.dot(triangle_[k]) > direction.dot(triangle_[best])) best = k;
    return triangle_[best];
  }
  const Triangle& triangle() const { return triangle_; }

 private:
  const Triangle& triangle_;
};

Vector anyPointOf(const ConvexSet& set) { return set.support(Vector::UnitX()); }
Vector anyPointOf(const TriangleSet& set) { return set.triangle()[0]; }

/// The largest absolute component of x - from, over all points x of the set.
double extentFrom(const Vector& from, const ConvexSet& set) {
  double extent = 0;
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1., 1.})
      extent = std::max(extent, std::fabs(set.support(side * Vector::Unit(k))[k] - from[k]));
  return extent;
}
double extentFrom(const Vector& from, const TriangleSet& set) {
  double extent = 0;
  for (const Vector& corner : set.triangle())
    extent = std::max(extent, (corner - from).lpNorm<Eigen::Infinity>());
  return extent;
}

/// The Minkowski difference of two convex sets. It contains the origin if they touch. `First` is
/// TriangleSet, which needs no virtual calls, or ConvexSet.
template <typename First>
class DifferenceSet {
 public:
  DifferenceSet(const First& first, const ConvexSet& second) : first_(first), second_(second) {}

  ADAPTIVE_BVH_INLINE Difference support(const Vector& direction) const {
    const Vector on_first = first_.support(direction), on_second = second_.support(-direction);
    return {on_first - on_second, on_first, on_second};
  }

  /// The largest absolute component of x - p, over all points x of both sets, where p is a point of
  /// the first.
  double extent() const {
    const Vector from = anyPointOf(first_);
    return std::max(extentFrom(from, first_), extentFrom(from, second_));
  }

 private:
  const First& first_;
  const ConvexSet& second_;
};

/// A simplex of up to four points of a Minkowski difference, and its point nearest to the origin,
/// which `reduce` finds.
class Simplex {
 public:
  void add(const Difference& point) { corners_[count_++] = point; }
  bool has(const Difference& point) const {
    return std::any_of(corners_, corners_ + count_,
                       [&](const Difference& corner) { return corner.value == point.value; });
  }

  /// Finds the point nearest to the origin among all corners and the interiors of all edges and
  /// faces. Keeps only the corners of the feature that contains this point.
  void reduce() {
    squared_norm_ = std::numeric_limits<double>::infinity();
    if (count_ == 4 && findOriginInside()) return;
    for (std::size_t i = 0; i < count_; ++i) {
      consider({i}, {1});
      for (std::size_t j = 0; j < i; ++j) {
        considerEdge(i, j);
        for (std::size_t k = 0; k < j; ++k) considerFace(i, j, k);
      }
    }
    Difference kept[3];
    for (std::size_t k = 0; k < nearest_.count; ++k) kept[k] = corners_[nearest_.corners[k]];
    std::copy_n(kept, nearest_.count, corners_);
    count_ = nearest_.count;
    for (std::size_t k = 0; k < count_; ++k) nearest_.corners[k] = k;
  }

  double squaredNorm() const { return squared_norm_; }
  template <typename Visit>
  void forEachCorner(const Visit& visit) const {
    std::for_each(corners_, corners_ + count_, visit);
  }
  /// Calls visit(normal), of length 1 or 0, for the simplex, if it is a face; for each face spanned
  /// by `point` and an edge of the simplex; and for each edge from `point` to a corner: there the
  /// normal is the direction perpendicular to the edge that is closest to nearest().
  template <typename Visit>
  void forEachFaceWith(const Difference& point, const Visit& visit) const {
    const auto edge = [&](std::size_t i, const Difference& from) -> Vector {
      return corners_[i].value - from.value;
    };
    if (count_ == 3) visit(edge(0, corners_[2]).cross(edge(1, corners_[2])).stableNormalized());
    for (std::size_t i = 0; i < count_; ++i) {
      const feature_distance::Edge to_corner(edge(i, point));
      visit(to_corner.across(nearest()).stableNormalized());
      for (std::size_t j = 0; j < i; ++j)
        visit(edge(i, point).cross(edge(j, point)).stableNormalized());
    }
  }
  /// The point nearest to the origin, and the points of both sets that it is the difference of.
  Vector nearest() const { return combine(&Difference::value); }
  PointPair points() const {
    return {combine(&Difference::on_first), combine(&Difference::on_second)};
  }

 private:
  /// A point of the simplex in barycentric coordinates: the weights of some of its corners.
  struct Combination {
    std::size_t count = 0, corners[4];
    double weights[4];
  };

  /// Keeps a combination of corners if it is nearer to the origin than all before.
  template <std::size_t kCount>
  void consider(const std::size_t (&corners)[kCount], const double (&weights)[kCount]) {
    Vector x = Vector::Zero();
    for (std::size_t k = 0; k < kCount; ++k) x += weights[k] * corners_[corners[k]].value;
    const double square = x.squaredNorm();
    if (!(square < squared_norm_)) return;
    squared_norm_ = square;
    nearest_.count = kCount;
    std::copy_n(corners, kCount, nearest_.corners);
    std::copy_n(weights, kCount, nearest_.weights);
  }
  /// Considers the projection of the origin on an edge, if it is inside the edge.
  void considerEdge(std::size_t i, std::size_t j) {
    const Vector& from = corners_[i].value;
    const double t = feature_distance::Edge(corners_[j].value - from).coordinate(-from);
    if (t > 0 && t < 1) consider({i, j}, {1 - t, t});
  }
  /// Considers the projection of the origin on a face, if it is inside the face. Like
  /// feature_distance.h, chooses the longest edge as the base.
  void considerFace(std::size_t i, std::size_t j, std::size_t k) {
    const auto square = [&](std::size_t a, std::size_t b) {
      return (corners_[a].value - corners_[b].value).squaredNorm();
    };
    if (square(j, k) > square(i, j) && square(j, k) >= square(i, k)) return considerFaceOn(j, k, i);
    if (square(i, k) > square(i, j)) return considerFaceOn(i, k, j);
    considerFaceOn(i, j, k);
  }
  /// The same for a face whose base is the edge from i to j. `share` and `along` are the weights of
  /// the apex and of j.
  void considerFaceOn(std::size_t i, std::size_t j, std::size_t apex) {
    const Vector &from = corners_[i].value, to_apex = corners_[apex].value - from;
    const feature_distance::Edge base(corners_[j].value - from);
    const Vector height = base.across(to_apex);
    const double share =
        -base.across(from).dot(height) * feature_distance::inverse(height.squaredNorm());
    const double along = base.coordinate(-from) - share * base.coordinate(to_apex);
    if (share > 0 && along > 0 && share + along < 1)
      consider({i, j, apex}, {1 - share - along, along, share});
  }
  /// Whether the tetrahedron contains the origin; if so, the origin is the nearest point. Decided
  /// by exact signs of volumes: in a nearly flat tetrahedron the signs of rounded volumes would be
  /// arbitrary. The volume of the origin and the face opposite to corner k is this corner's weight.
  bool findOriginInside() {
    double volumes[4], sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto x = [&](std::size_t i) -> const Vector& { return corners_[(k + i) % 4].value; };
      volumes[k] = (k % 2 ? -1 : 1) * orientation(x(1), x(2), x(3), Vector(Vector::Zero()));
      sum += volumes[k];
    }
    for (const double volume : volumes)
      if (!((volume > 0 && sum > 0) || (volume < 0 && sum < 0))) return false;
    nearest_.count = 4;
    for (std::size_t k = 0; k < 4; ++k) {
      nearest_.corners[k] = k;
      nearest_.weights[k] = volumes[k] / sum;
    }
    squared_norm_ = 0;
    return true;
  }
  Vector combine(Vector Difference::*member) const {
    Vector sum = Vector::Zero();
    for (std::size_t k = 0; k < nearest_.count; ++k)
      sum += nearest_.weights[k] * corners_[nearest_.corners[k]].*member;
    return sum;
  }

  Difference corners_[4];
  std::size_t count_ = 0;
  double squared_norm_ = std::numeric_limits<double>::infinity();  ///< of the nearest point
  Combination nearest_;
};

/// The separating plane of two convex sets with the widest gap so far. The gap is a lower bound of
/// the distance; it is negative if no plane that was tried separates the sets.
struct SeparatingPlane {
  Vector normal = Vector::Zero();  ///< unit vector from the second to the first
  double gap = -std::numeric_limits<double>::infinity();

  /// Keeps the normal m, of length 1, if its gap is the widest so far. Returns the point of the
  /// difference that is lowest along m.
  template <typename Differences>
  Difference tryNormal(const Vector& m, const Differences& differences) {
    const Difference lowest = differences.support(-m);
    const double gap_along_m = m.dot(lowest.value);
    if (gap_along_m > gap) normal = m, gap = gap_along_m;
    return lowest;
  }
};

/// Finishes a search (findGap) in which rounding hides that a support point beside the simplex
/// would bring the simplex nearer to the origin. That happens if the two sets have nearly parallel
/// or nearly flat faces. There the normal of a plane through an edge of the simplex and this point
/// is a better search direction than the simplex's nearest point.
template <typename Differences>
class FlatSearch {
 public:
  FlatSearch(const Differences& differences, double error, Simplex& simplex, SeparatingPlane& plane)
      : differences_(differences), error_(error), simplex_(simplex), plane_(plane) {
    simplex.forEachCorner([&](const Difference& corner) { points_[count_++] = corner; });
  }

  /// Improves the simplex and the plane, beginning with the point `beside`, until distance and gap
  /// agree up to the error, or no direction leads to a new point. The next point is the one in the
  /// direction with the widest gap, or else a new one.
  void run(Difference beside) {
    for (;;) {
      const bool is_new = !has(beside);
      if (is_new && count_ == kMostPoints) return;
      if (is_new) addPoint(beside);
      const double length = std::sqrt(simplex_.squaredNorm());
      Difference next = plane_.tryNormal(simplex_.nearest() / length, differences_);
      double widest = plane_.gap;
      simplex_.forEachFaceWith(beside, [&](const Vector& normal) {
        if (normal.isZero(0)) return;
        const Vector outward = normal.dot(beside.value) < 0 ? Vector(-normal) : normal;
        const Difference lowest = plane_.tryNormal(outward, differences_);
        if (plane_.gap > widest || (has(next) && !has(lowest))) next = lowest;
        widest = plane_.gap;
      });
      if (length - plane_.gap <= error_ || (!is_new && has(next))) return;
      beside = next;
    }
  }

 private:
  static constexpr std::size_t kMostPoints = 16;

  bool has(const Difference& point) const {
    return std::any_of(points_, points_ + count_,
                       [&](const Difference& other) { return other.value == point.value; });
  }
  /// Adds a point. Replaces the simplex by the edge or face of this point and one or two earlier
  /// points that is nearest to the origin, if that is nearer.
  void addPoint(const Difference& point) {
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        Simplex other;
        other.add(point);
        other.add(points_[i]);
        if (j < i) other.add(points_[j]);
        other.reduce();
        if (other.squaredNorm() < simplex_.squaredNorm()) simplex_ = other;
      }
    points_[count_++] = point;
  }

  const Differences& differences_;
  const double error_;  ///< allowed difference of distance and gap
  Simplex& simplex_;
  SeparatingPlane& plane_;
  Difference points_[kMostPoints];  ///< all points found, those of the first simplex included
  std::size_t count_ = 0;
};

/// The result of a search that ended with this simplex and this plane.
ConvexGap gapOf(const Simplex& simplex, const SeparatingPlane& plane) {
  const double distance = std::sqrt(simplex.squaredNorm());
  if (!(plane.gap > 0)) return {simplex.points(), distance, distance, Vector::Zero()};
  return {simplex.points(), distance, distance - plane.gap, plane.normal};
}

template <typename Differences>
[[gnu::noinline]] ConvexGap finishFlat(const Differences& differences, double error,
                                       Simplex simplex, SeparatingPlane plane,
                                       const Difference& beside) {
  FlatSearch<Differences>(differences, error, simplex, plane).run(beside);
  return gapOf(simplex, plane);
}

/// The algorithm of Gilbert, Johnson and Keerthi: adds the support point in the direction of the
/// simplex's nearest point and reduces the simplex, until the distance of that point and the widest
/// gap agree.
template <typename Differences>
ConvexGap findGap(const Differences& differences, const GapSearch& search) {
  constexpr double kTouching = 0x1p-46;
  const double extent = differences.extent(), error = search.error * extent;
  const double touching = kTouching * extent;
  Simplex simplex;
  simplex.add(differences.support(Vector::UnitX()));
  simplex.reduce();
  SeparatingPlane plane;
  const auto finish = [&](const Difference& beside) -> ConvexGap {
    return search.finishes_flat ? finishFlat(differences, error, simplex, plane, beside)
                                : gapOf(simplex, plane);
  };
  for (int step = 0; step < search.most_steps; ++step) {
    const Vector nearest = simplex.nearest();
    const double length = nearest.norm();
    if (length <= touching || simplex.squaredNorm() == 0)
      return {simplex.points(), 0, 0, Vector::Zero()};
    if (length < search.least) break;
    const Difference next = plane.tryNormal(nearest / length, differences);
    if (length - plane.gap <= error) break;
    if (simplex.has(next)) return finish(next);
    Simplex larger = simplex;
    larger.add(next);
    larger.reduce();
    if (!(larger.squaredNorm() < simplex.squaredNorm())) return finish(next);
    simplex = larger;
  }
  return gapOf(simplex, plane);
}

/// A polytope inside a Minkowski difference. It is expanded at the face nearest to the origin. The
/// distance of this face is a lower bound of the penetration depth; the extent of the difference
/// along any direction is an upper bound.
template <typename Differences>
class ExpandingPolytope {
 public:
  explicit ExpandingPolytope(const Differences& differences)
      : differences_(differences), extent_(differences.extent()) {}

  /// Expands the polytope until both bounds agree. Returns the direction of the smallest extent.
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
    if (best_.error > kError * extent_) polish();
    best_.depth = std::max(best_.depth, 0.);
    return best_;
  }

 private:
  static constexpr double kError = 1e-10;  ///< relative to the extent of both sets
  static constexpr int kMostSteps = 300;

  using Edge = std::pair<std::size_t, std::size_t>;
  struct Face {
    std::size_t corners[3];
    Vector normal;  ///< outward
    double offset;  ///< the plane's signed distance from the origin along the normal

    Edge edge(std::size_t k) const { return {corners[k], corners[(k + 1) % 3]}; }
    bool has(const Edge& other) const {
      return edge(0) == other || edge(1) == other || edge(2) == other;
    }
  };

  /// Returns the farthest point of the difference along a unit direction, and keeps the direction
  /// if its extent is the smallest so far: no shorter translation along it separates the two sets.
  Vector measure(const Vector& direction) {
    const Vector top = differences_.support(direction).value;
    const double depth = direction.dot(top);
    if (depth < best_.depth) best_ = {direction, depth, depth};
    return top;
  }

  /// Searches for a shorter translation in directions around the best one, with decreasing step
  /// sizes. Needed if both sets are round: there the polytope approaches the surface of the
  /// difference slowly.
  void polish() {
    constexpr double kSmallest = 1e-8, kGolden = 0.618, kTurn = 2 * 3.14159265358979323846;
    constexpr int kDirections = 8, kMostRounds = 1000;
    const double lower_bound = best_.depth - best_.error;
    double step = 0.1;
    for (int round = 0; round < kMostRounds && step > kSmallest; ++round) {
      const Vector n = best_.normal, u = n.unitOrthogonal(), v = n.cross(u);
      const double before = best_.depth;
      for (int k = 0; k < kDirections; ++k) {  // rotated by another angle in each round
        const double angle = (k + round * kGolden) * kTurn / kDirections;
        measure((n + step * (std::cos(angle) * u + std::sin(angle) * v)).normalized());
      }
      step *= best_.depth < before ? 1.5 : 0.5;
    }
    best_.error = best_.depth - lower_bound;
  }

  /// Builds a tetrahedron of extreme points. Returns false if the difference is flat: then the two
  /// sets touch without overlap.
  bool start() {
    const Vector low = measure(-Vector::UnitX()), high = measure(Vector::UnitX());
    if (!((high - low).norm() > kError * extent_)) return false;
    const Vector along = (high - low).stableNormalized();
    const Vector across =
        farthestAround(along, [&](const Vector& x) { return (x - low).cross(along).norm(); });
    const Vector normal = (high - low).cross(across - low).stableNormalized();
    const Vector up = measure(normal), down = measure(-normal);
    const Vector top =
        std::fabs(normal.dot(up - low)) > std::fabs(normal.dot(down - low)) ? up : down;
    corners_ = {low, high, across, top};
    if (!(std::fabs(normal.dot(top - low)) > kError * extent_)) return false;
    if (normal.dot(top - low) < 0) std::swap(corners_[0], corners_[1]);  // all faces turn outward
    addFace(0, 2, 1);
    addFace(0, 1, 3);
    addFace(1, 2, 3);
    addFace(2, 0, 3);
    return true;
  }
  /// Of the extreme points in four directions around an axis, the one with the greatest `distance`.
  template <typename Distance>
  Vector farthestAround(const Vector& axis, const Distance& distance) {
    const Vector first = axis.unitOrthogonal(), second = axis.cross(first);
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
    // A face without area is never the nearest one.
    const double offset =
        normal.isZero(0) ? std::numeric_limits<double>::infinity() : normal.dot(corners_[a]);
    faces_.push_back({{a, b, c}, normal, offset});
  }

  /// Adds the corner `top`: replaces the faces around `nearest` that are visible from it by faces
  /// from the edges of the hole to it. Returns false if `nearest` is not visible. Only visible
  /// faces connected to it by edges are replaced: where faces are nearly coplanar, rounding makes
  /// scattered faces seem visible, and their number would grow.
  bool grow(std::size_t nearest, const Vector& top) {
    const double least = 1e-3 * kError * extent_;
    const auto isVisible = [&](const Face& face) {
      return face.normal.dot(top) - face.offset > least;
    };
    if (!isVisible(faces_[nearest])) return false;
    std::vector<Edge> horizon;  // the edges of the hole, in the direction of the removed faces
    removeFace(nearest, horizon);
    for (std::size_t i = 0; i < faces_.size();) {
      const Face& face = faces_[i];
      const bool is_at_hole = std::any_of(horizon.begin(), horizon.end(), [&](const Edge& edge) {
        return face.has({edge.second, edge.first});
      });
      if (!is_at_hole || !isVisible(face)) {
        ++i;
        continue;
      }
      removeFace(i, horizon);
      i = 0;
    }
    corners_.push_back(top);
    for (const auto& [from, to] : horizon) addFace(from, to, corners_.size() - 1);
    return true;
  }
  /// Removes a face and updates the edges of the hole.
  void removeFace(std::size_t face, std::vector<Edge>& horizon) {
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

  const Differences& differences_;
  const double extent_;
  std::vector<Vector> corners_;
  std::vector<Face> faces_;
  /// The measured direction with the smallest extent; it points from the first set to the second.
  Penetration best_{Vector::UnitX(), std::numeric_limits<double>::infinity(), 0};
};

}  // namespace

Penetration ConvexSet::penetration(const TrianglePoints& triangle) const {
  return penetrationOf(triangle, *this);
}

ConvexGap convexGap(const ConvexSet& first, const ConvexSet& second, const GapSearch& search) {
  return findGap(DifferenceSet<ConvexSet>(first, second), search);
}
ConvexGap convexGap(const Triangle& triangle, const ConvexSet& set, const GapSearch& search) {
  return findGap(DifferenceSet<TriangleSet>(TriangleSet(triangle), set), search);
}

Penetration penetrationOf(const ConvexSet& first, const ConvexSet& second) {
  const DifferenceSet<ConvexSet> differences(first, second);
  return ExpandingPolytope<DifferenceSet<ConvexSet>>(differences).find();
}
Penetration penetrationOf(const Triangle& triangle, const ConvexSet& set) {
  const TriangleSet first(triangle);
  const DifferenceSet<TriangleSet> differences(first, set);
  return ExpandingPolytope<DifferenceSet<TriangleSet>>(differences).find();
}

}  // namespace adaptive_bvh
