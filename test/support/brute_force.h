#pragma once

#include <array>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fcl/narrowphase/distance_result.h>

#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace brute_force {
struct Judged;
}

/// The oracles: every pair of triangles, the second body in the frame of the first. Distances are
/// in long double, whether triangles intersect is decided in quadruple precision. No hierarchy
/// takes part.
class BruteForce {
 public:
  /// Each body is a DeformableMesh or any fcl::BVHModel.
  BruteForce(const BodyView& first, const fcl::Transform3d& tf1, const BodyView& second,
             const fcl::Transform3d& tf2)
      : first_(first), second_(second), relative_(tf1.inverse(Eigen::Isometry) * tf2) {}

  double distance() const;

  /// What is wrong with a result that claims `result.min_distance`, or nothing: the triangles it
  /// names must be so far apart, and its points that far apart and on them. (Which of several
  /// nearest pairs is named, is open. FCL's points of triangles that touch mean nothing.)
  std::string findError(const fcl::DistanceResultd& result, const fcl::Transform3d& tf1,
                        double tolerance) const;

  /// The pairs of triangles that intersect; of one model with itself the smaller index first.
  std::set<std::pair<int, int>> contacts() const;

 private:
  using Corners = std::array<const fcl::Vector3d*, 3>;
  static Corners corners(const BodyView& body, int t);
  static std::vector<brute_force::Judged> judged(const BodyView& body, const fcl::Transform3d& tf);

  const BodyView first_, second_;
  fcl::Transform3d relative_;
};

}  // namespace adaptive_bvh_test
