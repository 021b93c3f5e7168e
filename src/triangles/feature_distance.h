#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "base/rounding.h"

namespace adaptive_bvh {

/// The nearest points of two features, a vertex and a face or two edges, and their distance. A face
/// may be degenerate to a segment or a point, an edge to a point, and edges may be parallel.
///
/// Let R be the largest distance of two corners and u the unit roundoff of S. `distance` differs
/// from the exact one by at most 32 u R, whatever the shape of the face or the angle of the edges.
/// It differs from the distance of the two points by at most 8 u R, and the points lie on the
/// features up to 8 u times the largest coordinate. R may be as small as numbers are: tiny inputs
/// are scaled up first. docs/bounds.md, 16.
///
/// No normal is computed, because the normal of a needle is inaccurate. Instead, vectors are
/// projected along the longest edge (of the face, or of the two): their components along that edge
/// are subtracted.
struct FeatureDistance {
  using Point = Eigen::Matrix<double, 3, 1>;

  Point first, second;
  double distance;

  /// The vector from the second point to the first.
  Point difference() const { return first - second; }
};

namespace feature_distance {

using Point = Eigen::Matrix<double, 3, 1>;

/// 1 / x, or 0 if x is so small that 1 / x would overflow.
inline double inverse(double x) { return x > std::numeric_limits<double>::min() * 4 ? 1 / x : 0.; }

/// An edge, relative to its first corner.
struct Edge {
  Point along;                    ///< vector to the second corner
  double square, inverse_square;  ///< squared length, and its inverse or 0

  Edge() = default;
  explicit Edge(const Point& vector)
      : along(vector), square(vector.squaredNorm()), inverse_square(inverse(square)) {}

  /// The parameter, from 0 to 1, of the point of the edge nearest to x. `x` is relative to the
  /// first corner.
  double nearestTo(const Point& x) const {
    return std::clamp(x.dot(along) * inverse_square, 0., 1.);
  }
  /// The component of a vector along the edge, in units of the edge's length.
  double coordinate(const Point& x) const { return x.dot(along) * inverse_square; }
  /// The component of a vector perpendicular to the edge.
  Point across(const Point& x) const { return x - coordinate(x) * along; }
};

/// Finds the parameters s on the first and t on the second edge where the edges are nearest, if
/// both points are interior. Returns false if not, or if the edges are parallel. `between` is the
/// vector from the first corner of the first edge to that of the second.
inline bool nearestInside(const Edge& first, const Edge& second, const Point& between, double& s,
                          double& t) {
  if (first.square < second.square) return nearestInside(second, first, -between, t, s);
  // In projection along the first edge, the longer one, t is where the second edge is nearest.
  const Point other = first.across(second.along), from = first.across(between);
  t = -from.dot(other) * inverse(other.squaredNorm());
  if (t < 0 || t > 1) return false;
  s = first.coordinate(between + t * second.along);
  return s >= 0 && s <= 1;
}

/// The position of a point on a face: corner[edge] + along * (corner[edge + 1] - corner[edge]) +
/// share * (corner[edge + 2] - corner[edge]). On a side: `share` is 0 and `along` is from 0 and
/// below 1; 0 is a corner.
struct FacePlace {
  std::size_t edge = 0;
  double along = 0, share = 0;
  bool is_inside = false;
};

/// A triangle with precomputed edges and height for nearest-point searches.
class Face {
 public:
  using Corners = std::array<Point, 3>;

  explicit Face(const Corners& corners) : corners_(corners) {
    for (std::size_t k = 0; k < 3; ++k) {
      edges_[k] = Edge(corners[(k + 1) % 3] - corners[k]);
      if (edges_[k].square > edges_[base_].square) base_ = k;
    }
    const Point apex = corners[(base_ + 2) % 3] - corners[base_];
    apex_along_ = edges_[base_].coordinate(apex);
    height_ = edges_[base_].across(apex);
    inverse_height_ = inverse(height_.squaredNorm());
  }

  const Corners& corners() const { return corners_; }
  const Edge& edge(std::size_t k) const { return edges_[k]; }

  /// Finds the point of the face nearest to x, on a side or inside. Returns its distance.
  double distance(const Point& x, Point& on_face) const {
    FacePlace place;
    return distance(x, on_face, place);
  }
  /// Finds the nearest point and its position on the face. Returns its distance.
  double distance(const Point& x, Point& on_face, FacePlace& place) const {
    const double found = std::sqrt(squaredDistance(x, on_face, place));
    return found < rounding::shortLength<double>() ? shortDistance(x, on_face, place, found)
                                                   : found;
  }
  /// The square of `distance`, for lengths whose squares do not underflow.
  double squaredDistance(const Point& x, Point& on_face) const {
    FacePlace place;
    return squaredDistance(x, on_face, place);
  }
  double squaredDistance(const Point& x, Point& on_face, FacePlace& place) const {
    double best = std::numeric_limits<double>::infinity();
    Point from_best;  // relative to the first corner of its side
    // Keeps a candidate, given by its place and its vector from corner `edge`, if it is nearer.
    const auto consider = [&](const FacePlace& candidate, const Point& from_corner) {
      const double square = (corners_[candidate.edge] - x + from_corner).squaredNorm();
      constexpr double kSame = 16 * std::numeric_limits<double>::epsilon();
      const bool is_tie = best - kSame * best <= square && square <= best + kSame * best;
      if (is_tie ? !isNearer(x, candidate, from_corner, place, from_best) : !(square < best))
        return;
      best = square;
      from_best = from_corner;
      place = candidate;
    };
    // A corner is the beginning of a side, so its coordinates are used without rounding.
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = edges_[k].nearestTo(x - corners_[k]);
      if (along < 1) consider({k, along, 0, false}, along * edges_[k].along);
    }
    // If x is so far away that rounding leaves no side, any corner will do.
    if (!(best < std::numeric_limits<double>::infinity()))
      consider({0, 0, 0, false}, Point::Zero());
    const Edge& base = edges_[base_];
    const Point from_base = x - corners_[base_];
    const double along = base.coordinate(from_base),
                 share = base.across(from_base).dot(height_) * inverse_height_,
                 other =
                     along - share * apex_along_;  // barycentric coordinate of the end of the base
    if (share > 0 && other >= 0 && share + other <= 1)
      consider({base_, other, share, true}, along * base.along + share * height_);
    on_face = corners_[place.edge] + from_best;
    return best;
  }

 private:
  /// Whether the first of two points a and b of the face is nearer to x, by the bisecting plane
  /// between them: for a distant x their rounded distances may be equal. Each point is given by its
  /// place and its vector from corner `edge` of the place.
  bool isNearer(const Point& x, const FacePlace& place_a, const Point& from_corner_a,
                const FacePlace& place_b, const Point& from_corner_b) const {
    const Point y = x - corners_[0], a = corners_[place_a.edge] - corners_[0] + from_corner_a,
                b = corners_[place_b.edge] - corners_[0] + from_corner_b;
    return (a - b).dot((y - a) + (y - b)) > 0;
  }
  /// Recomputes a distance below shortLength() in enlarged coordinates, if all corners are so near
  /// x. `found` is the distance computed without; it is accurate otherwise.
  double shortDistance(const Point& x, Point& on_face, FacePlace& place, double found) const {
    if (on_face == x) return found;
    Corners from_x = corners_;
    double extent = 0;
    for (Point& corner : from_x) {
      corner -= x;
      extent = std::max(extent, corner.lpNorm<Eigen::Infinity>());
    }
    const double unit = rounding::enlargement(extent);
    if (unit == 1) return found;
    for (Point& corner : from_x) corner *= unit;
    const double square = Face(from_x).squaredDistance(Point::Zero(), on_face, place);
    on_face = x + on_face / unit;
    return std::sqrt(square) / unit;
  }

  Corners corners_;
  Edge edges_[3];         ///< edge k runs from corner k to the next
  std::size_t base_ = 0;  ///< the longest edge
  double apex_along_;     ///< coordinate along the base of the corner opposite to it
  Point height_;          ///< vector from the base line to that corner
  double inverse_height_;
};

}  // namespace feature_distance

/// The distance of a vertex (first) and a face (second).
inline FeatureDistance vertexFaceDistance(const Eigen::Matrix<double, 3, 1>& vertex,
                                          const std::array<Eigen::Matrix<double, 3, 1>, 3>& face) {
  FeatureDistance found;
  found.first = vertex;
  found.distance = feature_distance::Face(face).distance(vertex, found.second);
  return found;
}

/// Like edgeEdgeDistance, for lengths whose squares do not underflow.
inline FeatureDistance longEdgeEdgeDistance(const std::array<Eigen::Matrix<double, 3, 1>, 2>& a,
                                            const std::array<Eigen::Matrix<double, 3, 1>, 2>& b,
                                            std::array<double, 2>& along) {
  using Point = Eigen::Matrix<double, 3, 1>;
  const feature_distance::Edge u(a[1] - a[0]), v(b[1] - b[0]);
  const Point between = b[0] - a[0];
  FeatureDistance nearest;
  double best = std::numeric_limits<double>::infinity();
  const auto consider = [&](double s, double t) {
    const double square = (between + t * v.along - s * u.along).squaredNorm();
    if (!(square < best)) return;
    best = square;
    nearest.first = a[0] + s * u.along;
    nearest.second = b[0] + t * v.along;
    along = {s, t};
  };
  consider(0, v.nearestTo(-between));
  consider(1, v.nearestTo(a[1] - b[0]));
  consider(u.nearestTo(between), 0);
  consider(u.nearestTo(b[1] - a[0]), 1);
  double s, t;
  if (feature_distance::nearestInside(u, v, between, s, t)) consider(s, t);
  nearest.distance = std::sqrt(best);
  return nearest;
}

/// The distance of two edges. `along` receives the parameters of the nearest points: 0 at the first
/// end of an edge and 1 at the other.
inline FeatureDistance edgeEdgeDistance(const std::array<Eigen::Matrix<double, 3, 1>, 2>& a,
                                        const std::array<Eigen::Matrix<double, 3, 1>, 2>& b,
                                        std::array<double, 2>& along) {
  const FeatureDistance found = longEdgeEdgeDistance(a, b, along);
  if (!(found.distance < rounding::shortLength<double>())) return found;
  using Point = Eigen::Matrix<double, 3, 1>;
  const Point from_a[3] = {a[1] - a[0], b[0] - a[0], b[1] - a[0]};  // relative to a[0]
  const double unit = rounding::enlargement(
      std::max({from_a[0].lpNorm<Eigen::Infinity>(), from_a[1].lpNorm<Eigen::Infinity>(),
                from_a[2].lpNorm<Eigen::Infinity>()}));
  if (unit == 1) return found;
  const FeatureDistance large = longEdgeEdgeDistance({Point::Zero(), unit * from_a[0]},
                                                     {unit * from_a[1], unit * from_a[2]}, along);
  return {a[0] + large.first / unit, a[0] + large.second / unit, large.distance / unit};
}

inline FeatureDistance edgeEdgeDistance(const std::array<Eigen::Matrix<double, 3, 1>, 2>& a,
                                        const std::array<Eigen::Matrix<double, 3, 1>, 2>& b) {
  std::array<double, 2> along;
  return edgeEdgeDistance(a, b, along);
}

}  // namespace adaptive_bvh
