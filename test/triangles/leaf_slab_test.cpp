// LeafSlab never calls triangles apart that are not: against distances in long double, with corners
// that are off by what is allowed.
#include <algorithm>
#include <array>

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/triangle_lanes.h"
#include "triangles/triangle_block.h"

namespace adaptive_bvh_test {
namespace leaf_slab_test {

using adaptive_bvh::LeafSlab;
using adaptive_bvh::Vector4x3;
using exact::Real;

class LeafSlabs : public testing::Test {
 protected:
  /// Four triangles of a bent surface, or any four.
  std::array<PlainTriangle, 4> makeLeaf(const Eigen::Vector3d& place, double size) {
    const Eigen::Vector3d u = random_.direction(), v = u.cross(random_.direction()).normalized(),
                          n = u.cross(v);
    const bool is_surface = !random_.oneIn(3);
    const double bend = random_.size(-4, 0);
    std::array<PlainTriangle, 4> leaf;
    for (PlainTriangle& t : leaf) {
      t = anyTriangle(random_, place, size);
      if (!is_surface) continue;
      for (Eigen::Vector3d& x : t) {
        const double a = (x - place).dot(u), b = (x - place).dot(v);
        x = place + a * u + b * v + bend * (a * a - b * b) / size * n;
      }
    }
    return leaf;
  }

  /// Of each of the others to all of the leaf.
  static std::array<Real, 4> leastDistances(const std::array<PlainTriangle, 4>& leaf,
                                            const std::array<PlainTriangle, 4>& others) {
    std::array<Real, 4> least{1e30L, 1e30L, 1e30L, 1e30L};
    for (std::size_t k = 0; k < 4; ++k)
      for (const PlainTriangle& t : leaf)
        least[k] = std::min(least[k], exact::distance(exactly(t), exactly(others[k])));
    return least;
  }

  RandomGeometry random_{57};
};

TEST_F(LeafSlabs, SayOnlyWhatIsSo) {
  long apart = 0, farther = 0;
  for (int i = 0; i < manySteps(6000); ++i) {
    const double size = random_.size(-3, -0.5), error = random_.oneIn(2) ? 0 : random_.size(-7, -4);
    const Eigen::Vector3d place = random_.point();
    const auto leaf = makeLeaf(place, size);
    const auto other = makeLeaf(place + random_.point() * size * random_.size(-1, 1), size);
    Vector4x3 p[3], q[3];
    for (int lane = 0; lane < 4; ++lane) {
      setLane(p, lane, leaf[std::size_t(lane)], error, random_);
      setLane(q, lane, other[std::size_t(lane)], error, random_);
    }
    const auto least = leastDistances(leaf, other);
    const auto distance =
        static_cast<float>(random_.oneIn(4)   ? 0.
                           : random_.oneIn(2) ? double(least[std::size_t(random_.below(4))]) *
                                                    random_.size(-0.01, 0.01)
                                              : size * random_.size(-2, 1));
    const LeafSlab slab(p, distance, static_cast<float>(error + kLaneRounding));
    const unsigned said = slab.apart(q);
    for (int lane = 0; lane < 4; ++lane) {
      if (said >> lane & 1) {
        EXPECT_GT(least[std::size_t(lane)], distance);
      }
      apart += said >> lane & 1;
      farther += least[std::size_t(lane)] > distance;
    }
  }
  EXPECT_GT(double(apart), 0.3 * double(farther));
}

/// Sheets that lie above each other: what it is there for. Corners are off so that they look
/// farther apart than they are.
TEST_F(LeafSlabs, LeaveParallelSheetsOut) {
  constexpr int kSheets = 4000;
  long apart = 0;
  for (int i = 0; i < kSheets; ++i) {
    const double size = random_.size(-2, -0.5), gap = size * random_.size(-2, 0);
    const double error = random_.oneIn(2) ? 0 : random_.size(-7, -5);
    const Eigen::Vector3d place = random_.point(), u = random_.direction(),
                          v = u.cross(random_.direction()).normalized(), n = u.cross(v),
                          off = error * n.cwiseSign();
    std::array<PlainTriangle, 4> lower, upper;
    Vector4x3 p[3], q[3];
    for (int lane = 0; lane < 4; ++lane)
      for (const bool is_upper : {false, true}) {
        PlainTriangle t = anyTriangle(random_, Eigen::Vector3d::Zero(), size);
        for (Eigen::Vector3d& x : t) x = place + x[0] * u + x[1] * v + (is_upper ? gap : 0) * n;
        (is_upper ? upper : lower)[std::size_t(lane)] = t;
        for (Eigen::Vector3d& x : t) x += is_upper ? off : -off;
        setLane(is_upper ? q : p, lane, t, 0, random_);
      }
    const auto least = leastDistances(lower, upper);
    const auto allowed = static_cast<float>(error + kLaneRounding);
    const auto distance = static_cast<float>(double(*std::min_element(least.begin(), least.end())));
    const unsigned said = LeafSlab(p, distance, allowed).apart(q);
    for (int lane = 0; lane < 4; ++lane) {
      if (said >> lane & 1) {
        EXPECT_GT(least[std::size_t(lane)], distance);
      }
    }
    apart += LeafSlab(p, static_cast<float>(0.5 * gap), allowed).apart(q) == 15;
  }
  EXPECT_GT(double(apart), 0.5 * kSheets);
}

}  // namespace leaf_slab_test
}  // namespace adaptive_bvh_test
