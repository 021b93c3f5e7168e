#include "support/brute_force.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <fcl/narrowphase/detail/traversal/collision/intersect.h>

#include "support/exact_geometry.h"

namespace adaptive_bvh_test {

namespace {

/// A triangle in long double, and a ball around it.
struct Judged {
  exact::Triangle triangle;
  Eigen::Vector3d middle;
  double radius;

  template <typename S>
  Judged(const std::array<const Vector3<S>*, 3>& corners, const Eigen::Matrix3d& R,
         const Eigen::Vector3d& T) {
    Eigen::Vector3d x[3];
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = R * corners[k]->template cast<double>() + T;
      triangle[k] = exact::of(x[k]);
    }
    middle = (x[0] + x[1] + x[2]) / 3;
    radius = std::max({(x[0] - middle).norm(), (x[1] - middle).norm(), (x[2] - middle).norm()});
  }
};

}  // namespace

/// Pairs whose balls are farther apart than the nearest pair so far are left out.
template <typename S>
S BruteForce<S>::distance() const {
  const Eigen::Matrix3d R = relative_.linear().template cast<double>();
  const Eigen::Vector3d T = relative_.translation().template cast<double>();
  std::vector<Judged> first, second;
  for (int i = 0; i < first_.size; ++i)
    first.emplace_back(corners(first_, i), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  for (int j = 0; j < second_.size; ++j) second.emplace_back(corners(second_, j), R, T);
  double enough = std::numeric_limits<double>::max();
  for (const Judged& p : first)
    for (const Judged& q : second) enough = std::min(enough, (p.middle - q.middle).norm());
  exact::Real least = std::numeric_limits<double>::max();
  for (const Judged& p : first)
    for (const Judged& q : second) {
      if ((p.middle - q.middle).norm() - p.radius - q.radius > enough * (1 + 1e-9)) continue;
      least = std::min(least, exact::distance(p.triangle, q.triangle));
      enough = std::min(enough, static_cast<double>(least));
    }
  return least < exact::Real(std::numeric_limits<S>::max()) ? static_cast<S>(least)
                                                            : std::numeric_limits<S>::max();
}

template <typename S>
std::string BruteForce<S>::findError(const fcl::DistanceResult<S>& result,
                                     const fcl::Transform3<S>& tf1, S tolerance) const {
  if (result.o1 != first_.model || result.o2 != second_.model) return "names other objects";
  const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
  const Judged p(corners(first_, int(result.b1)), still, Eigen::Vector3d::Zero()),
      q(corners(second_, int(result.b2)), relative_.linear().template cast<double>(),
        relative_.translation().template cast<double>());
  const auto d = static_cast<S>(exact::distance(p.triangle, q.triangle));
  if (!(std::abs(d - result.min_distance) <= tolerance))
    return "names triangles at another distance";
  if (d <= 0) return "";
  const auto& points = result.nearest_points;
  if (!(std::abs((points[0] - points[1]).norm() - d) <= tolerance))
    return "its points are at another distance";
  const fcl::Transform3<S> to_first = tf1.inverse(Eigen::Isometry);
  const auto offTriangle = [&](const Vector3<S>& point, const Judged& t) {
    const Vector3<S> x = to_first * point;
    return static_cast<S>(exact::distance(t.triangle, exact::of(x)));
  };
  if (!(offTriangle(points[0], p) <= tolerance)) return "its first point lies off";
  if (!(offTriangle(points[1], q) <= tolerance)) return "its second point lies off";
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
template <typename Visit>
void BruteForce<S>::forEachPair(Visit&& visit) const {
  for (int i = 0; i < first_.size; ++i)
    for (int j = 0; j < second_.size; ++j) visit(i, j, corners(first_, i), corners(second_, j));
}

template class BruteForce<float>;
template class BruteForce<double>;

}  // namespace adaptive_bvh_test
