#pragma once

#include <algorithm>

#include "base/rounding.h"
#include "query/nearest/triangle_separation.h"

namespace adaptive_bvh {

/// Pairs of triangles of two leaves that single precision cannot tell from the limit, and their
/// separations in double precision. One direction is tested for all pairs at once: where surfaces
/// lie along each other, most pairs of two leaves are equally near and share their normals.
///
/// A pair is a bit: 4 j + i for triangle i of the first leaf and j of the second. Coordinates are
/// those of the first mesh's frame, relative to a corner, so that hardly any digit is lost.
class TiedTriangles {
 public:
  using Point = fcl::Vector3d;

  /// `first` and `second` return the vertices of a triangle of a leaf.
  template <typename First, typename Second>
  TiedTriangles(const TriangleSeparation<double>& triangles, unsigned pairs, const First& first,
                const Second& second) {
    const Point origin = triangles.first(first(__builtin_ctz(pairs) & 3)[0]);
    for (int k = 0; k < 4; ++k) {
      if (pairs & 0x1111u << k) first_.set(k, first(k), origin, triangles, firstOf);
      if (pairs & 0xfu << 4 * k) second_.set(k, second(k), origin, triangles, secondOf);
    }
  }

  /// Returns which of the pairs are at least `limit`, > 0, apart along a direction of any length,
  /// whichever triangle comes first. None if the square of the length underflows.
  unsigned apartAlong(const Point& along, double limit, unsigned pairs) const {
    const double length = along.norm();
    if (!(length > rounding::tiny<double>())) return 0;
    const Ranges a = first_.along(along), b = second_.along(along);
    const double enough = limit * length;
    unsigned apart = 0;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        apart |= unsigned(std::max(b.low[j] - a.high[i], a.low[i] - b.high[j]) >= enough)
                 << (4 * j + i);
    return apart & pairs;
  }
  /// Returns which of the pairs are at least `limit` apart along the line between the centroids of
  /// the pair `bit`, or along a normal of its triangles. Stops when that pair is.
  unsigned apartNear(int bit, double limit, unsigned pairs) const {
    const int i = bit & 3, j = bit >> 2;
    unsigned apart = 0;
    const auto separates = [&](const Point& along) -> bool {
      apart |= apartAlong(along, limit, pairs);
      return apart >> bit & 1;
    };
    separates(first_.normal(i)) || separates(second_.normal(j)) ||
        separates(second_.cornerSum(j) - first_.cornerSum(i));
    return apart;
  }

 private:
  struct Ranges {
    double low[4], high[4];
  };
  /// Corners of four triangles.
  struct Corners {
    double x[3][4] = {}, y[3][4] = {}, z[3][4] = {};

    template <typename PointOf>
    void set(int k, const VertexIndices& vertices, const Point& origin,
             const TriangleSeparation<double>& triangles, const PointOf& pointOf) {
      for (std::size_t c = 0; c < 3; ++c) {
        const Point p = pointOf(triangles, vertices[c]) - origin;
        x[c][k] = p[0];
        y[c][k] = p[1];
        z[c][k] = p[2];
      }
    }
    Point corner(int c, int k) const { return {x[c][k], y[c][k], z[c][k]}; }
    Point normal(int k) const {
      return (corner(1, k) - corner(0, k)).cross(corner(2, k) - corner(0, k));
    }
    Point cornerSum(int k) const { return corner(0, k) + corner(1, k) + corner(2, k); }
    Ranges along(const Point& direction) const {
      Ranges ranges;
      for (int k = 0; k < 4; ++k) {
        double at[3];
        for (int c = 0; c < 3; ++c)
          at[c] = direction[0] * x[c][k] + direction[1] * y[c][k] + direction[2] * z[c][k];
        ranges.low[k] = std::min(std::min(at[0], at[1]), at[2]);
        ranges.high[k] = std::max(std::max(at[0], at[1]), at[2]);
      }
      return ranges;
    }
  };
  static Point firstOf(const TriangleSeparation<double>& triangles, unsigned vertex) {
    return triangles.first(vertex);
  }
  static Point secondOf(const TriangleSeparation<double>& triangles, unsigned vertex) {
    return triangles.secondInFirst(vertex);
  }

  Corners first_, second_;
};

}  // namespace adaptive_bvh
