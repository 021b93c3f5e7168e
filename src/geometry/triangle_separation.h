#pragma once

#include <array>

#include <fcl/geometry/bvh/BVH_model.h>

#include "geometry/mesh_view.h"
#include "geometry/rigid.h"
#include "geometry/rounding.h"
#include "geometry/triangle_gap.h"

namespace adaptive_bvh {

/// Pairs of triangles, one of each mesh: cheap lower bounds of their distance, and the distance.
/// All in the frame of the first mesh.
template <typename S>
class TriangleSeparation {
 public:
  using Point = fcl::Vector3<S>;

  TriangleSeparation(const Point* vertices1, const fcl::Transform3<S>& tf1, const Point* vertices2,
                     const fcl::Transform3<S>& tf2)
      : vertices1_(vertices1),
        vertices2_(vertices2),
        to_first_(tf1, tf2),
        R_(to_first_.R.template cast<S>()),
        T_(to_first_.T.template cast<S>()) {}

  /// From now on separations are measured along the line from `from`, on the first mesh, to `to`,
  /// on the second; both in the first's frame. Points so near each other that squares underflow
  /// have no line between them.
  void lookAlong(const Point& from, const Point& to) {
    const S length = (to - from).norm();
    if (!(length > rounding::tiny<S>())) return;
    from_ = from;
    to_ = R_.transpose() * (to - T_);
    along1_ = (to - from) / length;
    along2_ = R_.transpose() * along1_;
    offset_ = along1_.dot(R_ * to_ + T_ - from);
  }

  const fcl::Matrix3<S>& R() const { return R_; }
  const Point& T() const { return T_; }
  /// The line's direction, of length 1; zero before there is one.
  const Point& direction() const { return along1_; }

  /// How far apart two triangles are along that line: a lower bound of their distance. Everything
  /// is measured from the two points, so that near them, where it matters, hardly any digit is
  /// lost.
  S separation(const VertexIndices& a, const VertexIndices& b) const {
    const auto on1 = [&](unsigned v) { return along1_.dot(vertices1_[v] - from_); };
    const auto on2 = [&](unsigned v) { return along2_.dot(vertices2_[v] - to_); };
    const S high = std::max(std::max(on1(a[0]), on1(a[1])), on1(a[2]));
    const S low = std::min(std::min(on2(b[0]), on2(b[1])), on2(b[2]));
    return low + offset_ - high;
  }

  /// The largest separation of two triangles along the line between their middles and along
  /// either's normal. Stops at the first that reaches `limit`, > 0.
  S separationNearby(const VertexIndices& a, const VertexIndices& b, S limit) const {
    const Point& near = vertices1_[a[0]];
    Point p[3], q[3];
    for (int k = 0; k < 3; ++k) {
      p[k] = vertices1_[a[k]] - near;
      q[k] = R_ * vertices2_[b[k]] + T_ - near;
    }
    S best = std::numeric_limits<S>::lowest();
    const auto along = [&](const Point& d) {
      const S length = d.norm();
      if (!(length > rounding::tiny<S>())) return false;
      const S p0 = d.dot(p[0]), p1 = d.dot(p[1]), p2 = d.dot(p[2]);
      const S q0 = d.dot(q[0]), q1 = d.dot(q[1]), q2 = d.dot(q[2]);
      const S forward = std::min(std::min(q0, q1), q2) - std::max(std::max(p0, p1), p2);
      const S backward = std::min(std::min(p0, p1), p2) - std::max(std::max(q0, q1), q2);
      best = std::max(best, std::max(forward, backward) / length);
      return best >= limit;
    };
    along(q[0] + q[1] + q[2] - p[0] - p[1] - p[2]) || along((p[1] - p[0]).cross(p[2] - p[0])) ||
        along((q[1] - q[0]).cross(q[2] - q[0]));
    return best;
  }

  /// The corners of a triangle of either mesh, in the first's frame.
  std::array<Point, 3> firstCorners(const VertexIndices& a) const {
    return {vertices1_[a[0]], vertices1_[a[1]], vertices1_[a[2]]};
  }
  std::array<fcl::Vector3d, 3> secondCorners(const VertexIndices& b) const {
    return {to_first_(vertices2_[b[0]]), to_first_(vertices2_[b[1]]), to_first_(vertices2_[b[2]])};
  }

  /// The distance of gapOf, and the nearest points.
  S distance(const VertexIndices& a, const VertexIndices& b, Point& on_a, Point& on_b) const {
    const TriangleGap gap = gapOf(pointsAs<double>(firstCorners(a)), secondCorners(b));
    on_a = gap.points.first.template cast<S>();
    on_b = gap.points.second.template cast<S>();
    return distanceAs<S>(gap.distance);
  }

 private:
  const Point *vertices1_, *vertices2_;
  RelativePlacement to_first_;
  fcl::Matrix3<S> R_;
  Point T_;
  Point along1_ = Point::Zero(), along2_ = Point::Zero();  // the line, in either mesh's frame
  Point from_ = Point::Zero(), to_ = Point::Zero();
  S offset_ = 0;
};

}  // namespace adaptive_bvh
