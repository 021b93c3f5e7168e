#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace adaptive_bvh {

/// The nearest points of two features, a vertex and a face or two edges, and their distance. A face
/// may be a segment or a point, an edge a point; edges may be parallel.
///
/// With R the largest distance of two corners and u the unit roundoff of S: the points lie on the
/// features up to 8 u R, and `distance` is theirs up to 8 u R. So it is nowhere smaller than the
/// exact one by more than 16 u R; and nowhere larger by more than 16 u R, but for a face whose
/// height is small (h of its longest edge L) by 16 u R L / h, and for edges at a small angle a by
/// 16 u R / a; and never by more than 4 sqrt(u) R. (Where h and a are below sqrt(u), a side of the
/// face and the ends of the edges are as near as that.) A product of lengths that underflows is
/// taken for 0: lengths below 2^-255 of double, 2^-31 of float, count as none.
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

/// How far along p + t e, t from 0 to 1, the point nearest to the origin is.
template <typename S>
S nearestOnEdge(const Point<S>& p, const Point<S>& e) {
  const S square = e.squaredNorm();
  return square > 0 ? std::clamp(-p.dot(e) / square, S(0), S(1)) : S(0);
}

/// The point of a segment p + t e that is nearest to the origin.
template <typename S>
Point<S> nearestOfEdge(const Point<S>& p, const Point<S>& e) {
  return p + nearestOnEdge(p, e) * e;
}

/// The point of a face that is nearest to the origin: on one of its sides, or inside.
template <typename S>
Point<S> nearestOfFace(const std::array<Point<S>, 3>& face) {
  const Point<S> edges[3] = {face[1] - face[0], face[2] - face[1], face[0] - face[2]};
  Point<S> nearest = face[0];
  S best = nearest.squaredNorm();
  const auto take = [&](const Point<S>& x) {
    const S square = x.squaredNorm();
    if (square < best) {
      best = square;
      nearest = x;
    }
  };
  const Point<S> normal = edges[0].cross(edges[1]);
  S weights[3], sum = 0;  // of the corner opposite of an edge
  bool inside = true;
  for (std::size_t k = 0; k < 3; ++k) {
    take(nearestOfEdge(face[k], edges[k]));
    weights[k] = normal.dot(face[k].cross(edges[k]));
    inside = inside && weights[k] > 0;
    sum += weights[k];
  }
  if (inside)
    take((weights[1] / sum) * face[0] + (weights[2] / sum) * face[1] +
         (weights[0] / sum) * face[2]);
  return nearest;
}

}  // namespace feature_distance

/// Of a vertex (first) and a face.
template <typename S>
FeatureDistance<S> vertexFaceDistance(const Eigen::Matrix<S, 3, 1>& vertex,
                                      const std::array<Eigen::Matrix<S, 3, 1>, 3>& face) {
  using Point = Eigen::Matrix<S, 3, 1>;
  const Point away = feature_distance::nearestOfFace<S>(
      {Point(face[0] - vertex), Point(face[1] - vertex), Point(face[2] - vertex)});
  return {vertex, vertex + away, away.norm()};
}

/// Of two edges.
template <typename S>
FeatureDistance<S> edgeEdgeDistance(const std::array<Eigen::Matrix<S, 3, 1>, 2>& a,
                                    const std::array<Eigen::Matrix<S, 3, 1>, 2>& b) {
  using Point = Eigen::Matrix<S, 3, 1>;
  using feature_distance::nearestOnEdge;
  const Point u = a[1] - a[0], v = b[1] - b[0], w = b[0] - a[0];
  FeatureDistance<S> nearest;
  S best = -1;
  const auto take = [&](S s, S t) {
    const Point away = w + t * v - s * u;
    const S square = away.squaredNorm();
    if (best >= 0 && !(square < best)) return;
    best = square;
    nearest.first = a[0] + s * u;
    nearest.second = b[0] + t * v;
  };
  take(0, nearestOnEdge<S>(w, v));
  take(1, nearestOnEdge<S>(b[0] - a[1], v));
  take(nearestOnEdge<S>(-w, u), 0);
  take(nearestOnEdge<S>(a[0] - b[1], u), 1);
  const Point normal = u.cross(v);
  const S square = normal.squaredNorm();
  if (square > 0) {
    const S s = std::clamp(w.cross(v).dot(normal) / square, S(0), S(1));
    const S t = nearestOnEdge<S>(w - s * u, v);
    take(nearestOnEdge<S>(-w - t * v, u), t);
  }
  nearest.distance = std::sqrt(best);
  return nearest;
}

}  // namespace adaptive_bvh
