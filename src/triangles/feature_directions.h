#pragma once

#include <array>

#include <Eigen/Geometry>

#include "triangles/feature_distance.h"

namespace adaptive_bvh {

/// Candidate directions in which two features, a vertex and a face or two edges, may be separated:
/// unit vectors from the second to the first.
class FeatureDirections {
 public:
  using Point = Eigen::Vector3d;
  using Corners = std::array<Point, 4>;

  static constexpr int kCount = 5;

  /// `firsts` is the number of corners of the first feature: of a vertex 1, of an edge 2.
  FeatureDirections(int firsts, const Corners& x) : firsts_(firsts) {
    edges_[0] = firsts == 1 ? x[2] - x[1] : x[1] - x[0];
    edges_[1] = x[3] - x[2];
    edges_[2] = x[3] - x[1];
    difference_ = (firsts == 1 ? vertexFaceDistance(x[0], {x[1], x[2], x[3]})
                               : edgeEdgeDistance({x[0], x[1]}, {x[2], x[3]}))
                      .difference();
  }

  /// Candidate k, the likeliest first; zero if there is none. 0: the difference of the nearest
  /// points. 1: the common normal of edges 0 and 1. 2 and above: the part of the difference that is
  /// perpendicular to edge k - 2.
  ///
  /// Near contact the difference has lost its digits. The normal has not, nor has a direction
  /// perpendicular to an edge. The normal of edges at an angle a has an error of 2^-53 / a. After
  /// it is made perpendicular to one of the edges, the remaining error lies in the plane of both,
  /// where the width of the features is only a times their length.
  Point operator[](int k) const {
    if (k == 0) return unit(difference_);
    if (k == 1) {
      const Point normal = perpendicular(edges_[0].cross(edges_[1]), edges_[0]);
      return unit(normal.dot(difference_) < 0 ? Point(-normal) : normal);
    }
    if (firsts_ == 2 && k == 4) return Point::Zero();
    return unit(perpendicular(difference_, edges_[k - 2]));
  }
  /// The part of the difference of the nearest points that is perpendicular to a vector, of length
  /// 1; zero if there is none.
  Point across(const Point& vector) const { return unit(perpendicular(difference_, vector)); }

 private:
  /// Normalizes a direction; zero if its length is inaccurate.
  static Point unit(const Point& direction) {
    const double length = direction.norm();
    return length > 1e-150 ? Point(direction / length) : Point(Point::Zero());
  }
  /// The component of x perpendicular to an edge; computed twice, against rounding.
  static Point perpendicular(const Point& x, const Point& edge) {
    const double square = edge.squaredNorm();
    if (!(square > 0)) return Point::Zero();
    const Point once = x - (x.dot(edge) / square) * edge;
    return once - (once.dot(edge) / square) * edge;
  }

  int firsts_;
  Point edges_[3];    ///< of the face, or of the two edges; the last is not used for edges
  Point difference_;  ///< from the nearest point of the second feature to that of the first
};

}  // namespace adaptive_bvh
