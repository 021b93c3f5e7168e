#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "base/rounding.h"

namespace adaptive_bvh {

/// The nearest points of two features, a vertex and a face or two edges, and their distance. A face
/// may be a segment or a point, an edge a point; edges may be parallel.
///
/// With R the largest distance of two corners and u the unit roundoff of S: `distance` is the exact
/// one up to 32 u R, whatever the shape of the face and whatever the angle of the edges. It is that
/// of the points up to 8 u R, and they lie on the features up to 8 u of the largest coordinate.
/// R may be as small as numbers are: what is short altogether is enlarged first.
/// docs/bounds.md, 16.
///
/// No normal is computed, which a needle hardly has: everything is seen across the longest edge
/// (of a face, or of the two), as what is left of a vector without its component along that edge.
template <typename S>
struct FeatureDistance {
  using Point = Eigen::Matrix<S, 3, 1>;

  Point first, second;
  S distance;

  /// From the second to the first.
  Point difference() const { return first - second; }
};

namespace feature_distance {

template <typename S>
using Point = Eigen::Matrix<S, 3, 1>;

/// 1 / x, or 0 where x is so small that this overflows.
template <typename S>
S inverse(S x) {
  return x > std::numeric_limits<S>::min() * 4 ? 1 / x : S(0);
}

/// An edge, from a corner on.
template <typename S>
struct Edge {
  Point<S> along;
  S square, inverse_square;

  Edge() = default;
  explicit Edge(const Point<S>& vector)
      : along(vector), square(vector.squaredNorm()), inverse_square(inverse(square)) {}

  /// How far along the edge the point nearest to x is, from 0 to 1. `x` is seen from the corner.
  S nearestTo(const Point<S>& x) const {
    return std::clamp(x.dot(along) * inverse_square, S(0), S(1));
  }
  /// The component of a vector along the edge, in its lengths.
  S coordinate(const Point<S>& x) const { return x.dot(along) * inverse_square; }
  /// The rest of the vector.
  Point<S> across(const Point<S>& x) const { return x - coordinate(x) * along; }
};

/// Where two edges are nearest inside both: s on the first, t on the second. False where they are
/// not, or parallel. `between`: from the first's corner to the second's.
template <typename S>
bool nearestInside(const Edge<S>& first, const Edge<S>& second, const Point<S>& between, S& s,
                   S& t) {
  if (first.square < second.square) return nearestInside<S>(second, first, -between, t, s);
  const Point<S> other = first.across(second.along), from = first.across(between);
  t = -from.dot(other) * inverse(other.squaredNorm());
  if (t < 0 || t > 1) return false;
  s = first.coordinate(between + t * second.along);
  return s >= 0 && s <= 1;
}

/// Where a point of a face lies: on the edge from corner `edge` to the next, at `along`, from 0 on
/// and below 1; or inside, `share` of the way from there up to the opposite corner.
template <typename S>
struct FacePlace {
  std::size_t edge = 0;
  S along = 0, share = 0;
  bool is_inside = false;
};

/// A triangle, prepared for the search of its nearest points.
template <typename S>
class Face {
 public:
  using Corners = std::array<Point<S>, 3>;

  explicit Face(const Corners& corners) : corners_(corners) {
    for (std::size_t k = 0; k < 3; ++k) {
      edges_[k] = Edge<S>(corners[(k + 1) % 3] - corners[k]);
      if (edges_[k].square > edges_[base_].square) base_ = k;
    }
    const Point<S> apex = corners[(base_ + 2) % 3] - corners[base_];
    apex_along_ = edges_[base_].coordinate(apex);
    height_ = edges_[base_].across(apex);
    inverse_height_ = inverse(height_.squaredNorm());
  }

  const Corners& corners() const { return corners_; }
  const Edge<S>& edge(std::size_t k) const { return edges_[k]; }

  /// Finds its point nearest to x, on one of the sides or inside. Returns the distance.
  S distance(const Point<S>& x, Point<S>& on_face) const {
    FacePlace<S> place;
    return distance(x, on_face, place);
  }
  /// Also finds where on the face that point lies.
  S distance(const Point<S>& x, Point<S>& on_face, FacePlace<S>& place) const {
    const S found = std::sqrt(squaredDistance(x, on_face, place));
    return found < rounding::shortLength<S>() ? shortDistance(x, on_face, place, found) : found;
  }
  /// The square of `distance`, where squares of lengths are not too small.
  S squaredDistance(const Point<S>& x, Point<S>& on_face) const {
    FacePlace<S> place;
    return squaredDistance(x, on_face, place);
  }
  S squaredDistance(const Point<S>& x, Point<S>& on_face, FacePlace<S>& place) const {
    S best = std::numeric_limits<S>::infinity();
    Point<S> from_best;  // from the corner of its side
    const auto take = [&](const FacePlace<S>& at, const Point<S>& from_corner) {
      const S square = (corners_[at.edge] - x + from_corner).squaredNorm();
      constexpr S kSame = 16 * std::numeric_limits<S>::epsilon();
      const bool is_tie = best - kSame * best <= square && square <= best + kSame * best;
      if (is_tie ? !isNearer(x, at, from_corner, place, from_best) : !(square < best)) return;
      best = square;
      from_best = from_corner;
      place = at;
    };
    // A corner counts as the begin of its side: as it is, without rounding.
    for (std::size_t k = 0; k < 3; ++k) {
      const S along = edges_[k].nearestTo(x - corners_[k]);
      if (along < 1) take({k, along, 0, false}, along * edges_[k].along);
    }
    // From so far away that a side is less than rounding.
    if (!(best < std::numeric_limits<S>::infinity())) take({0, 0, 0, false}, Point<S>::Zero());
    const Edge<S>& base = edges_[base_];
    const Point<S> from_base = x - corners_[base_];
    const S along = base.coordinate(from_base),
            share = base.across(from_base).dot(height_) * inverse_height_,
            other = along - share * apex_along_;  // barycentric, of the end of the base
    if (share > 0 && other >= 0 && share + other <= 1)
      take({base_, other, share, true}, along * base.along + share * height_);
    on_face = corners_[place.edge] + from_best;
    return best;
  }

 private:
  /// Which of two points of the face is nearer to x, by the plane between them: from far away their
  /// distances may be the same number. Each is given by its place, and from the corner there.
  bool isNearer(const Point<S>& x, const FacePlace<S>& one, const Point<S>& from_one,
                const FacePlace<S>& other, const Point<S>& from_other) const {
    const Point<S> seen = x - corners_[0], a = corners_[one.edge] - corners_[0] + from_one,
                   b = corners_[other.edge] - corners_[0] + from_other;
    return (a - b).dot((seen - a) + (seen - b)) > 0;
  }
  /// `found`: what was found so far, which is right unless all corners are near x.
  S shortDistance(const Point<S>& x, Point<S>& on_face, FacePlace<S>& place, S found) const {
    if (on_face == x) return found;
    Corners seen = corners_;
    S extent = 0;
    for (Point<S>& corner : seen) {
      corner -= x;
      extent = std::max(extent, corner.template lpNorm<Eigen::Infinity>());
    }
    const S unit = rounding::enlargement(extent);
    if (unit == 1) return found;
    for (Point<S>& corner : seen) corner *= unit;
    const S square = Face(seen).squaredDistance(Point<S>::Zero(), on_face, place);
    on_face = x + on_face / unit;
    return std::sqrt(square) / unit;
  }

  Corners corners_;
  Edge<S> edges_[3];
  std::size_t base_ = 0;  ///< the longest edge
  S apex_along_;          ///< the corner opposite of it: its coordinate along the base
  Point<S> height_;       ///< and its vector from there
  S inverse_height_;
};

}  // namespace feature_distance

/// Distance of a vertex (first) and a face.
template <typename S>
FeatureDistance<S> vertexFaceDistance(const Eigen::Matrix<S, 3, 1>& vertex,
                                      const std::array<Eigen::Matrix<S, 3, 1>, 3>& face) {
  FeatureDistance<S> found;
  found.first = vertex;
  found.distance = feature_distance::Face<S>(face).distance(vertex, found.second);
  return found;
}

/// Of two edges, where squares of lengths are not too small; see edgeEdgeDistance.
template <typename S>
FeatureDistance<S> longEdgeEdgeDistance(const std::array<Eigen::Matrix<S, 3, 1>, 2>& a,
                                        const std::array<Eigen::Matrix<S, 3, 1>, 2>& b,
                                        std::array<S, 2>& along) {
  using Point = Eigen::Matrix<S, 3, 1>;
  const feature_distance::Edge<S> u(a[1] - a[0]), v(b[1] - b[0]);
  const Point between = b[0] - a[0];
  FeatureDistance<S> nearest;
  S best = std::numeric_limits<S>::infinity();
  const auto take = [&](S s, S t) {
    const S square = (between + t * v.along - s * u.along).squaredNorm();
    if (!(square < best)) return;
    best = square;
    nearest.first = a[0] + s * u.along;
    nearest.second = b[0] + t * v.along;
    along = {s, t};
  };
  take(0, v.nearestTo(-between));
  take(1, v.nearestTo(a[1] - b[0]));
  take(u.nearestTo(between), 0);
  take(u.nearestTo(b[1] - a[0]), 1);
  S s, t;
  if (feature_distance::nearestInside<S>(u, v, between, s, t)) take(s, t);
  nearest.distance = std::sqrt(best);
  return nearest;
}

/// Of two edges. `along`: where the points lie on them, 0 at the first end and 1 at the other.
template <typename S>
FeatureDistance<S> edgeEdgeDistance(const std::array<Eigen::Matrix<S, 3, 1>, 2>& a,
                                    const std::array<Eigen::Matrix<S, 3, 1>, 2>& b,
                                    std::array<S, 2>& along) {
  const FeatureDistance<S> found = longEdgeEdgeDistance<S>(a, b, along);
  if (!(found.distance < rounding::shortLength<S>())) return found;
  using Point = Eigen::Matrix<S, 3, 1>;
  const Point seen[3] = {a[1] - a[0], b[0] - a[0], b[1] - a[0]};
  const S unit = rounding::enlargement(std::max({seen[0].template lpNorm<Eigen::Infinity>(),
                                                 seen[1].template lpNorm<Eigen::Infinity>(),
                                                 seen[2].template lpNorm<Eigen::Infinity>()}));
  if (unit == 1) return found;
  const FeatureDistance<S> large = longEdgeEdgeDistance<S>({Point::Zero(), unit * seen[0]},
                                                           {unit * seen[1], unit * seen[2]}, along);
  return {a[0] + large.first / unit, a[0] + large.second / unit, large.distance / unit};
}

template <typename S>
FeatureDistance<S> edgeEdgeDistance(const std::array<Eigen::Matrix<S, 3, 1>, 2>& a,
                                    const std::array<Eigen::Matrix<S, 3, 1>, 2>& b) {
  std::array<S, 2> along;
  return edgeEdgeDistance<S>(a, b, along);
}

}  // namespace adaptive_bvh
