#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/rigid.h"
#include "base/rounding.h"
#include "mesh/mesh_view.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// The distance of two triangles, one of each mesh, and cheap lower bounds of it, in the frame of
/// the first mesh and in double precision.
class TriangleSeparation {
 public:
  using Point = fcl::Vector3d;

  /// A line between a point of the first mesh and one of the second. Each point, and the line's
  /// direction of length 1, is in its mesh's own frame. Both directions are zero before a line is
  /// set.
  struct Line {
    Point from = Point::Zero(), along1 = Point::Zero();
    Point to = Point::Zero(), along2 = Point::Zero();
    double offset = 0;  ///< distance of the points along the line
  };

  TriangleSeparation(const Point* vertices1, const Point* vertices2,
                     const RelativePlacement& to_first)
      : vertices1_(vertices1), vertices2_(vertices2), to_first_(to_first) {}

  /// Sets the line along which separations are measured: from `from`, on the first mesh, to `to`,
  /// on the second; both in the first's frame. Does nothing if the points are so near each other
  /// that squares underflow.
  void lookAlong(const Point& from, const Point& to) {
    const double length = (to - from).norm();
    if (length > rounding::tiny<double>()) setLine(from, to, (to - from) / length);
  }
  /// Turns the line to the normal of one of two triangles, if that is nearly the same direction and
  /// separates the triangles by at least `enough`.
  void preferNormals(const VertexIndices& a, const VertexIndices& b, double enough) {
    constexpr double kNearly = 0.999;
    const Point normals[2] = {
        normalOf(first(a[0]), first(a[1]), first(a[2])),
        to_first_.R * normalOf(vertices2_[b[0]], vertices2_[b[1]], vertices2_[b[2]])};
    const Line before = line_;
    for (const Point& normal : normals) {
      const double cosine = normal.dot(before.along1);
      if (!(std::abs(cosine) > kNearly)) continue;
      turnLine(cosine > 0 ? normal : Point(-normal));
      if (separation(a, b) >= enough) return;
    }
    line_ = before;
  }
  /// Sets the line's direction, of length 1. The two points stay.
  void turnLine(const Point& along) {
    line_.along1 = along;
    line_.along2 = to_first_.R.transpose() * along;
    line_.offset = along.dot(to_first_.R * line_.to + to_first_.T - line_.from);
  }

  const Line& line() const { return line_; }
  /// The line's direction in the first mesh's frame.
  const Point& direction() const { return line_.along1; }
  const Point* vertices1() const { return vertices1_; }
  const Point* vertices2() const { return vertices2_; }

  /// How far apart two triangles are along the line: a lower bound of their distance. Everything is
  /// measured from the line's two points, so that hardly any digit is lost near them, where it
  /// matters.
  double separation(const VertexIndices& a, const VertexIndices& b) const {
    const auto on1 = [&](unsigned v) -> double { return line_.along1.dot(first(v) - line_.from); };
    const auto on2 = [&](unsigned v) -> double {
      return line_.along2.dot(vertices2_[v] - line_.to);
    };
    const double high = std::max(std::max(on1(a[0]), on1(a[1])), on1(a[2]));
    const double low = std::min(std::min(on2(b[0]), on2(b[1])), on2(b[2]));
    return low + line_.offset - high;
  }

  /// The distance of two triangles, and their nearest points.
  TriangleGap gap(const VertexIndices& a, const VertexIndices& b) const {
    return gapOf({first(a[0]), first(a[1]), first(a[2])},
                 {secondInFirst(b[0]), secondInFirst(b[1]), secondInFirst(b[2])});
  }

  /// A vertex of either mesh in the first's frame.
  Point first(unsigned v) const { return vertices1_[v]; }
  Point secondInFirst(unsigned v) const { return to_first_(vertices2_[v]); }

 private:
  static Point normalOf(const Point& a, const Point& b, const Point& c) {
    return (b - a).cross(c - a).stableNormalized();
  }
  void setLine(const Point& from, const Point& to, const Point& along) {
    line_.from = from;
    line_.to = to_first_.R.transpose() * (to - to_first_.T);
    turnLine(along);
  }

  const Point *vertices1_, *vertices2_;
  const RelativePlacement to_first_;
  Line line_;
};

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
  TiedTriangles(const TriangleSeparation& triangles, unsigned pairs, const First& first,
                const Second& second) {
    const Point origin = triangles.first(first(__builtin_ctz(pairs) & 3)[0]);
    for (int k = 0; k < 4; ++k) {
      if (pairs & 0x1111u << k) {
        const VertexIndices v = first(k);
        for (std::size_t c = 0; c < 3; ++c) first_.set(c, k, triangles.first(v[c]) - origin);
      }
      if (pairs & 0xfu << 4 * k) {
        const VertexIndices v = second(k);
        for (std::size_t c = 0; c < 3; ++c)
          second_.set(c, k, triangles.secondInFirst(v[c]) - origin);
      }
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

    void set(std::size_t c, int k, const Point& p) {
      x[c][k] = p[0];
      y[c][k] = p[1];
      z[c][k] = p[2];
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

  Corners first_, second_;
};

}  // namespace adaptive_bvh
