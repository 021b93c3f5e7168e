#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "support/meshes.h"

namespace adaptive_bvh_test {

/// A cloth of springs that falls, by a simple solver: each step minimises the energy of springs and
/// inertia by Jacobi's iterations.
class FallingCloth {
 public:
  using P = fcl::Vector3d;
  using Points = std::vector<P>;

  /// A square of side 1 at a height, with its middle over the origin.
  FallingCloth(int cells, double height) : mesh_(plate(cells, cells)) {
    for (P& x : mesh_.vertices) x += P(-0.5, -0.5, height + 0.01 * std::sin(7 * x[0]));
    now_ = mesh_.vertices;
    velocity_.assign(now_.size(), P::Zero());
    for (const fcl::Triangle& t : mesh_.triangles)
      for (int k = 0; k < 3; ++k) {
        const std::size_t a = t[k], b = t[(k + 1) % 3];
        springs_.push_back({a, b, (now_[a] - now_[b]).norm()});
      }
  }

  const TriangleMesh& mesh() const { return mesh_; }
  const Points& positions() const { return now_; }

  /// Ten iterations, the first of which proposes free fall; accept(proposed, positions) moves the
  /// positions toward what is proposed.
  template <typename Accept>
  void step(const Accept& accept) {
    const Points before = now_;
    inertial_ = now_;
    for (std::size_t v = 0; v < now_.size(); ++v)
      inertial_[v] += kTime * (velocity_[v] + kTime * P(0, 0, -9.81));
    accept(inertial_, now_);
    for (int iteration = 1; iteration < 10; ++iteration) accept(proposal(), now_);
    for (std::size_t v = 0; v < now_.size(); ++v)
      velocity_[v] = 0.98 * (now_[v] - before[v]) / kTime;
  }

 private:
  struct Spring {
    std::size_t first, second;
    double length;
  };
  static constexpr double kTime = 0.01, kStiffness = 2;  // relative to the inertia

  /// Each vertex as if the others stayed where they are.
  Points proposal() const {
    Points sum = inertial_;
    std::vector<double> weights(now_.size(), 1);
    for (const Spring& spring : springs_) {
      const P along = now_[spring.first] - now_[spring.second];
      const P part = along * (spring.length / std::max(along.norm(), 1e-12));
      sum[spring.first] += kStiffness * (now_[spring.second] + part);
      sum[spring.second] += kStiffness * (now_[spring.first] - part);
      weights[spring.first] += kStiffness;
      weights[spring.second] += kStiffness;
    }
    for (std::size_t v = 0; v < sum.size(); ++v) sum[v] /= weights[v];
    return sum;
  }

  TriangleMesh mesh_;
  Points now_, velocity_, inertial_;
  std::vector<Spring> springs_;
};

}  // namespace adaptive_bvh_test
