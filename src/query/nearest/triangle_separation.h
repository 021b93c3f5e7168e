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
/// the first mesh and in double precision. P: number type of the positions.
template <typename P>
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

  TriangleSeparation(const fcl::Vector3<P>* vertices1, const fcl::Vector3<P>* vertices2,
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
    const Point normals[2] = {normalOf(first(a[0]), first(a[1]), first(a[2])),
                              to_first_.R * normalOf(second(b[0]), second(b[1]), second(b[2]))};
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
  const fcl::Vector3<P>* vertices1() const { return vertices1_; }
  const fcl::Vector3<P>* vertices2() const { return vertices2_; }

  /// How far apart two triangles are along the line: a lower bound of their distance. Everything is
  /// measured from the line's two points, so that hardly any digit is lost near them, where it
  /// matters.
  double separation(const VertexIndices& a, const VertexIndices& b) const {
    const auto on1 = [&](unsigned v) -> double { return line_.along1.dot(first(v) - line_.from); };
    const auto on2 = [&](unsigned v) -> double { return line_.along2.dot(second(v) - line_.to); };
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
  Point first(unsigned v) const { return vertices1_[v].template cast<double>(); }
  Point secondInFirst(unsigned v) const { return to_first_(second(v)); }

 private:
  static Point normalOf(const Point& a, const Point& b, const Point& c) {
    return (b - a).cross(c - a).stableNormalized();
  }
  void setLine(const Point& from, const Point& to, const Point& along) {
    line_.from = from;
    line_.to = to_first_.R.transpose() * (to - to_first_.T);
    turnLine(along);
  }

  Point second(unsigned v) const { return vertices2_[v].template cast<double>(); }

  const fcl::Vector3<P>*vertices1_, *vertices2_;
  const RelativePlacement to_first_;
  Line line_;
};

}  // namespace adaptive_bvh
