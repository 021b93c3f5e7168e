#include "support/brute_force.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "support/exact_geometry.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {

namespace brute_force {

/// A triangle in double and in long double, and a ball around it.
struct Judged {
  std::array<Eigen::Vector3d, 3> x;
  exact::Triangle triangle;
  Eigen::Vector3d middle;
  double radius;

  Judged(const std::array<const fcl::Vector3d*, 3>& corners, const Eigen::Matrix3d& R,
         const Eigen::Vector3d& T) {
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = R * corners[k]->template cast<double>() + T;
      triangle[k] = exact::of(x[k]);
    }
    middle = (x[0] + x[1] + x[2]) / 3;
    radius = std::max({(x[0] - middle).norm(), (x[1] - middle).norm(), (x[2] - middle).norm()});
  }

  bool touches(const Judged& other) const {
    if (isBeyond(other)) return false;
    for (const Eigen::Vector3d& corner : x)
      if (corner == other.x[0] || corner == other.x[1] || corner == other.x[2]) return true;
    if (isOnOneSideOf(other) || other.isOnOneSideOf(*this)) return false;
    return quad::touch({quad::of(x[0]), quad::of(x[1]), quad::of(x[2])},
                       {quad::of(other.x[0]), quad::of(other.x[1]), quad::of(other.x[2])});
  }

 private:
  /// Whether boxes along the axes are apart: comparisons have no error.
  bool isBeyond(const Judged& other) const {
    const auto low = [](const Judged& t) {
      return t.x[0].cwiseMin(t.x[1]).cwiseMin(t.x[2]).eval();
    };
    const auto high = [](const Judged& t) {
      return t.x[0].cwiseMax(t.x[1]).cwiseMax(t.x[2]).eval();
    };
    return (high(*this).array() < low(other).array()).any() ||
           (high(other).array() < low(*this).array()).any();
  }
  /// Whether all corners are clearly on one side of the other's plane.
  bool isOnOneSideOf(const Judged& other) const {
    const Eigen::Vector3d u = other.x[1] - other.x[0], v = other.x[2] - other.x[0];
    double sides[3], unsure = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d w = x[k] - other.x[0];
      sides[k] = u.cross(v).dot(w);
      unsure = std::max(unsure, 1e-13 * u.norm() * v.norm() * w.norm());
    }
    return std::min({sides[0], sides[1], sides[2]}) > unsure ||
           std::max({sides[0], sides[1], sides[2]}) < -unsure;
  }
};

}  // namespace brute_force

using brute_force::Judged;

std::vector<Judged> BruteForce::judged(const BodyView& body, const fcl::Transform3d& tf) {
  std::vector<Judged> triangles;
  for (int t = 0; t < body.num_tris; ++t)
    triangles.emplace_back(corners(body, t), tf.linear(), tf.translation());
  return triangles;
}

/// Pairs whose balls are farther apart than the nearest pair so far are left out.
double BruteForce::distance() const {
  const std::vector<Judged> first = judged(first_, fcl::Transform3d::Identity()),
                            second = judged(second_, relative_);
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
  return least < exact::Real(std::numeric_limits<double>::max())
             ? static_cast<double>(least)
             : std::numeric_limits<double>::max();
}

std::string BruteForce::findError(const fcl::DistanceResultd& result, const fcl::Transform3d& tf1,
                                  double tolerance) const {
  if (result.o1 != first_.geometry || result.o2 != second_.geometry) return "names other objects";
  const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
  const Judged p(corners(first_, int(result.b1)), still, Eigen::Vector3d::Zero()),
      q(corners(second_, int(result.b2)), relative_.linear(), relative_.translation());
  const auto d = static_cast<double>(exact::distance(p.triangle, q.triangle));
  if (!(std::abs(d - result.min_distance) <= tolerance))
    return "names triangles at another distance";
  if (d <= 0) return "";
  const auto& points = result.nearest_points;
  if (!(std::abs((points[0] - points[1]).norm() - d) <= tolerance))
    return "its points are at another distance";
  const fcl::Transform3d to_first = tf1.inverse(Eigen::Isometry);
  const auto offTriangle = [&](const fcl::Vector3d& point, const Judged& t) {
    const fcl::Vector3d x = to_first * point;
    return static_cast<double>(exact::distance(t.triangle, exact::of(x)));
  };
  if (!(offTriangle(points[0], p) <= tolerance)) return "its first point lies off";
  if (!(offTriangle(points[1], q) <= tolerance)) return "its second point lies off";
  return "";
}

std::set<std::pair<int, int>> BruteForce::contacts() const {
  const std::vector<Judged> first = judged(first_, fcl::Transform3d::Identity()),
                            second = judged(second_, relative_);
  std::set<std::pair<int, int>> found;
  const bool is_self = first_.geometry == second_.geometry && relative_.matrix().isIdentity(0);
  for (std::size_t i = 0; i < first.size(); ++i)
    for (std::size_t j = is_self ? i + 1 : 0; j < second.size(); ++j)
      if (first[i].touches(second[j])) found.emplace(i, j);
  return found;
}

typename BruteForce::Corners BruteForce::corners(const BodyView& body, int t) {
  const fcl::Triangle& triangle = body.tri_indices[t];
  return {&body.vertices[triangle[0]], &body.vertices[triangle[1]], &body.vertices[triangle[2]]};
}

}  // namespace adaptive_bvh_test
