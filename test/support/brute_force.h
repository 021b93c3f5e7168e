#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>
#include <fcl/narrowphase/detail/traversal/collision/intersect.h>
#include <fcl/narrowphase/distance_result.h>

#include "support/meshes.h"

namespace adaptive_bvh_test {

/// The oracles: every pair of triangles, by FCL's own triangle routines, in the frame FCL uses (the
/// second body in the frame of the first). No hierarchy takes part.
template <typename S>
class BruteForce {
 public:
  BruteForce(const fcl::BVHModel<fcl::RSS<S>>& first, const fcl::Transform3<S>& tf1,
             const fcl::BVHModel<fcl::RSS<S>>& second, const fcl::Transform3<S>& tf2)
      : first_(first), second_(second), relative_(tf1.inverse(Eigen::Isometry) * tf2) {}

  S distance() const {
    S least = std::numeric_limits<S>::max();
    forEachPair([&](int, int, const VertexIndices& p, const VertexIndices& q) {
      Vector3<S> on_p, on_q;
      least = std::min(least, fcl::detail::TriangleDistance<S>::triDistance(
                                  *p[0], *p[1], *p[2], *q[0], *q[1], *q[2], relative_, on_p, on_q));
    });
    return least;
  }

  /// What is wrong with a result that claims `result.min_distance`, or nothing: the triangles it
  /// names must be so far apart, and its points that far apart and on them. (Which of several
  /// nearest pairs is named, is open. FCL's points of triangles that touch mean nothing.)
  std::string objection(const fcl::DistanceResult<S>& result, const fcl::Transform3<S>& tf1,
                        S tolerance) const {
    if (result.o1 != &first_ || result.o2 != &second_) return "names other objects";
    const VertexIndices p = corners(first_, result.b1), q = corners(second_, result.b2);
    Vector3<S> on_p, on_q;
    const S d = fcl::detail::TriangleDistance<S>::triDistance(*p[0], *p[1], *p[2], *q[0], *q[1],
                                                              *q[2], relative_, on_p, on_q);
    if (!(std::abs(d - result.min_distance) <= tolerance))
      return "names triangles at another distance";
    if (d <= 0) return "";
    const auto& points = result.nearest_points;
    if (!(std::abs((points[0] - points[1]).norm() - d) <= tolerance))
      return "its points are at another distance";
    const fcl::Transform3<S> to_first = tf1.inverse(Eigen::Isometry);
    const fcl::Transform3<S> to_second = (tf1 * relative_).inverse(Eigen::Isometry);
    if (!(offTriangle(to_first * points[0], p) <= tolerance)) return "its first point lies off";
    if (!(offTriangle(to_second * points[1], q) <= tolerance)) return "its second point lies off";
    return "";
  }

  /// The pairs of triangles that intersect.
  std::set<std::pair<int, int>> contacts() const {
    const fcl::Matrix3<S> R = relative_.linear();
    const Vector3<S> T = relative_.translation();
    std::set<std::pair<int, int>> found;
    forEachPair([&](int i, int j, const VertexIndices& p, const VertexIndices& q) {
      if (fcl::detail::Intersect<S>::intersect_Triangle(*p[0], *p[1], *p[2], *q[0], *q[1], *q[2], R,
                                                        T))
        found.emplace(i, j);
    });
    return found;
  }

 private:
  using VertexIndices = std::array<const Vector3<S>*, 3>;

  static VertexIndices corners(const fcl::BVHModel<fcl::RSS<S>>& model, int t) {
    const fcl::Triangle& triangle = model.tri_indices[t];
    return {&model.vertices[triangle[0]], &model.vertices[triangle[1]],
            &model.vertices[triangle[2]]};
  }

  static S offTriangle(const Vector3<S>& x, const VertexIndices& t) {
    Vector3<S> on_x, on_t;
    return fcl::detail::TriangleDistance<S>::triDistance(x, x, x, *t[0], *t[1], *t[2], on_x, on_t);
  }

  template <typename Visit>
  void forEachPair(Visit&& visit) const {
    for (int i = 0; i < first_.num_tris; ++i)
      for (int j = 0; j < second_.num_tris; ++j)
        visit(i, j, corners(first_, i), corners(second_, j));
  }

  const fcl::BVHModel<fcl::RSS<S>>& first_;
  const fcl::BVHModel<fcl::RSS<S>>& second_;
  fcl::Transform3<S> relative_;
};

}  // namespace adaptive_bvh_test
