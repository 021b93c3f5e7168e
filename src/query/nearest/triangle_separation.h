#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/rigid.h"
#include "base/rounding.h"
#include "base/vectors.h"
#include "mesh/mesh_view.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// The distance of two triangles, one of each of two meshes, and a cheap lower bound: their
/// separation along a line. In double precision and the meshes' unit. Triangles are given by their
/// three vertex indices: `a` of the first mesh, `b` of the second.
class TriangleSeparation {
 public:
  using Point = fcl::Vector3d;

  /// A point near each mesh, and a direction of length 1 from the first mesh to the second. Both
  /// directions are zero before the line is set.
  struct Line {
    Point from = Point::Zero(), along1 = Point::Zero();  ///< in the first mesh's frame
    Point to = Point::Zero(), along2 = Point::Zero();    ///< in the second's: the same direction
    double offset = 0;  ///< position of `to` along the direction, relative to `from`
  };

  /// `to_first`: maps the second mesh's frame to the first's.
  TriangleSeparation(const Point* vertices1, const Point* vertices2,
                     const RelativePlacement& to_first)
      : vertices1_(vertices1), vertices2_(vertices2), to_first_(to_first) {}

  /// Sets the line from a point of the first mesh to a point of the second, both in the first's
  /// frame. Does nothing if the points are so near each other that squares underflow.
  void lookAlong(const Point& from, const Point& to) {
    const double length = (to - from).norm();
    if (length > rounding::tiny<double>()) setLine(from, to, (to - from) / length);
  }
  /// Turns the line to the normal of one of two triangles, if that is nearly the same direction and
  /// separates the triangles by at least `enough`.
  void preferNormals(const VertexIndices& a, const VertexIndices& b, double enough) {
    constexpr double kNearly = 0.999;  // cosine of the largest angle
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
  const RelativePlacement& toFirst() const { return to_first_; }

  /// Returns how far triangle b is beyond triangle a along the line: a lower bound of their
  /// distance; may be negative. Positions are relative to the line's point on their mesh, so that
  /// few digits are lost near these points, where accuracy matters.
  double separation(const VertexIndices& a, const VertexIndices& b) const {
    const auto x1 = [&](auto v) -> double { return line_.along1.dot(first(v) - line_.from); };
    const auto x2 = [&](auto v) -> double { return line_.along2.dot(vertices2_[v] - line_.to); };
    const double high1 = std::max(std::max(x1(a[0]), x1(a[1])), x1(a[2]));
    const double low2 = std::min(std::min(x2(b[0]), x2(b[1])), x2(b[2]));
    return low2 + line_.offset - high1;
  }

  /// Returns the distance of two triangles and their nearest points, in the first mesh's frame.
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

/// Separations in double precision of pairs of triangles of two leaves that are tied: single
/// precision cannot decide whether they are nearer than a limit. Tests each direction for all
/// pairs: where surfaces lie along each other, most pairs are equally near and share normals.
///
/// A pair is a bit: 4 j + i for triangle i of the first leaf and j of the second. Coordinates are
/// those of the first mesh's frame, relative to a corner, so that few digits are lost.
class TiedTriangles {
 public:
  using Point = fcl::Vector3d;

  /// first(i), second(j): vertices of a triangle of each leaf. Reads only the triangles of `pairs`.
  template <typename First, typename Second>
  TiedTriangles(const TriangleSeparation& triangles, unsigned pairs, const First& first,
                const Second& second) {
    const Point origin = triangles.first(first(__builtin_ctz(pairs) & 3)[0]);
    for (int k = 0; k < 4; ++k) {
      if (pairs & 0x1111u << k) {
        const VertexIndices v = first(k);
        for (std::size_t c = 0; c < 3; ++c) first_.set(c, k, triangles.first(v[c]));
      }
      if (pairs & 0xfu << 4 * k) {
        const VertexIndices v = second(k);
        for (std::size_t c = 0; c < 3; ++c) second_.set(c, k, triangles.vertices2()[v[c]]);
      }
    }
    first_.moveTo(origin);
    second_.place(triangles.toFirst());
    second_.moveTo(origin);
  }

  /// Returns which of `pairs` are at least `limit` > 0 apart along a direction of any length,
  /// whichever triangle comes first. None if the square of that length underflows.
  unsigned apartAlong(const Point& along, double limit, unsigned pairs) const {
    const double length = along.norm();
    if (!(length > rounding::tiny<double>())) return 0;
    const Ranges a = first_.along(along), b = second_.along(along);
    const D enough = packs::all(limit * length);
    unsigned apart = 0;
    for (int j = 0; j < 4; ++j) {
      const D low = packs::all(b.low[j / 2][j % 2]), high = packs::all(b.high[j / 2][j % 2]);
      for (int half = 0; half < 2; ++half) {
        const D gap = packs::upper<D>(low - a.high[half], a.low[half] - high);
        apart |= packs::bitsOf2(gap >= enough) << (4 * j + 2 * half);
      }
    }
    return apart & pairs;
  }
  /// Returns which of `pairs` are found to be at least `limit` apart. Tries directions for the pair
  /// `bit` until that pair is apart: both normals, and three times the centroids' difference.
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
  using D = Pack<double>;

  /// Projections of four triangles on a direction: of the triangles 0 and 1, and of 2 and 3.
  struct Ranges {
    D low[2], high[2];
  };
  /// Corners of four triangles: corner[c][k / 2] has corner c of triangle k in its lane k % 2.
  struct Corners {
    Vectors<D> corner[3][2] = {};

    void set(std::size_t c, int k, const Point& p) {
      Vectors<D>& pair = corner[c][k / 2];
      pair.x[k % 2] = p[0];
      pair.y[k % 2] = p[1];
      pair.z[k % 2] = p[2];
    }
    /// Makes all corners relative to `origin`.
    void moveTo(const Point& origin) {
      const Vectors<D> from = all(origin);
      for (auto& pairs : corner)
        for (Vectors<D>& pair : pairs) pair = vectors::difference(pair, from);
    }
    /// Maps all corners to the first mesh's frame.
    void place(const RelativePlacement& to_first) {
      const Vectors<D> rows[3] = {all(to_first.R.row(0)), all(to_first.R.row(1)),
                                  all(to_first.R.row(2))},
                       shift = all(to_first.T);
      for (auto& pairs : corner)
        for (Vectors<D>& pair : pairs)
          pair = {vectors::dot(rows[0], pair) + shift.x, vectors::dot(rows[1], pair) + shift.y,
                  vectors::dot(rows[2], pair) + shift.z};
    }
    Point at(int c, int k) const {
      const Vectors<D>& pair = corner[c][k / 2];
      return {pair.x[k % 2], pair.y[k % 2], pair.z[k % 2]};
    }
    Point normal(int k) const { return (at(1, k) - at(0, k)).cross(at(2, k) - at(0, k)); }
    Point cornerSum(int k) const { return at(0, k) + at(1, k) + at(2, k); }
    Ranges along(const Point& direction) const {
      const Vectors<D> n = all(direction);
      Ranges ranges;
      for (int half = 0; half < 2; ++half) {
        const D a = vectors::dot(n, corner[0][half]), b = vectors::dot(n, corner[1][half]),
                c = vectors::dot(n, corner[2][half]);
        ranges.low[half] = packs::lower<D>(packs::lower<D>(a, b), c);
        ranges.high[half] = packs::upper<D>(packs::upper<D>(a, b), c);
      }
      return ranges;
    }
    template <typename Vector>
    static Vectors<D> all(const Vector& v) {
      return {packs::all(v[0]), packs::all(v[1]), packs::all(v[2])};
    }
  };

  Corners first_, second_;
};

}  // namespace adaptive_bvh
