#include "support/brute_force.h"

#include <algorithm>
#include <limits>

#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>
#include <fcl/narrowphase/detail/traversal/collision/intersect.h>

namespace adaptive_bvh_test {

template <typename S>
S BruteForce<S>::distance() const {
  S least = std::numeric_limits<S>::max();
  forEachPair([&](int, int, const Corners& p, const Corners& q) {
    Vector3<S> on_p, on_q;
    least = std::min(least, fcl::detail::TriangleDistance<S>::triDistance(
                                *p[0], *p[1], *p[2], *q[0], *q[1], *q[2], relative_, on_p, on_q));
  });
  return least;
}

template <typename S>
std::string BruteForce<S>::findError(const fcl::DistanceResult<S>& result,
                                     const fcl::Transform3<S>& tf1, S tolerance) const {
  if (result.o1 != first_.model || result.o2 != second_.model) return "names other objects";
  const Corners p = corners(first_, result.b1), q = corners(second_, result.b2);
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

template <typename S>
std::set<std::pair<int, int>> BruteForce<S>::contacts() const {
  const fcl::Matrix3<S> R = relative_.linear();
  const Vector3<S> T = relative_.translation();
  std::set<std::pair<int, int>> found;
  forEachPair([&](int i, int j, const Corners& p, const Corners& q) {
    if (fcl::detail::Intersect<S>::intersect_Triangle(*p[0], *p[1], *p[2], *q[0], *q[1], *q[2], R,
                                                      T))
      found.emplace(i, j);
  });
  return found;
}

template <typename S>
typename BruteForce<S>::Corners BruteForce<S>::corners(const Mesh& mesh, int t) {
  const fcl::Triangle& triangle = mesh.triangles[t];
  return {&mesh.vertices[triangle[0]], &mesh.vertices[triangle[1]], &mesh.vertices[triangle[2]]};
}

template <typename S>
S BruteForce<S>::offTriangle(const Vector3<S>& x, const Corners& t) {
  Vector3<S> on_x, on_t;
  return fcl::detail::TriangleDistance<S>::triDistance(x, x, x, *t[0], *t[1], *t[2], on_x, on_t);
}

template <typename S>
template <typename Visit>
void BruteForce<S>::forEachPair(Visit&& visit) const {
  for (int i = 0; i < first_.size; ++i)
    for (int j = 0; j < second_.size; ++j) visit(i, j, corners(first_, i), corners(second_, j));
}

template class BruteForce<float>;
template class BruteForce<double>;

}  // namespace adaptive_bvh_test
