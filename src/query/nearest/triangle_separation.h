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

}  // namespace adaptive_bvh
