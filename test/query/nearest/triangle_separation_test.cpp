// TriangleSeparation against the distance of two triangles in long double.
#include "query/nearest/triangle_separation.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace triangle_separation_test {

using adaptive_bvh::RelativePlacement;
using adaptive_bvh::TriangleGap;
using adaptive_bvh::TriangleSeparation;
using adaptive_bvh::VertexIndices;
using exact::Real;

constexpr VertexIndices kOnly = {0, 1, 2};
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
const double kRoot = std::sqrt(std::numeric_limits<double>::denorm_min());

class Triangles : public testing::Test {
 protected:
  using P = fcl::Vector3d;
  using Corners = std::array<P, 3>;

  struct Pair {
    Corners a, b;
    fcl::Transform3d tf1, tf2;

    RelativePlacement toFirst() const { return {tf1, tf2}; }
    TriangleSeparation separation() const { return {a.data(), b.data(), toFirst()}; }
    exact::Triangle first() const { return {exact::of(a[0]), exact::of(a[1]), exact::of(a[2])}; }
    /// In the first's frame, by the relative placement that all queries take.
    exact::Triangle second() const {
      const RelativePlacement to_first = toFirst();
      const exact::Placement placed{exact::of(to_first.R), exact::of(to_first.T)};
      return placed(exact::Triangle{exact::of(b[0]), exact::of(b[1]), exact::of(b[2])});
    }
    /// "A few epsilon times the coordinates in the first object's frame" (docs/bounds.md).
    Real error() const {
      Real sum = exact::of(toFirst().T).template lpNorm<1>();
      Real largest[2] = {0, 0};
      for (int k = 0; k < 3; ++k) {
        largest[0] = std::max(largest[0], exact::of(a[std::size_t(k)]).template lpNorm<1>());
        largest[1] = std::max(largest[1], exact::of(b[std::size_t(k)]).template lpNorm<1>());
      }
      sum += largest[0] + largest[1];
      return 4 * Real(kEpsilon) * sum;
    }
  };

  /// Beside each other: the second's first corner is set near the first's; offsets of meshes and
  /// poses of any size.
  Pair pair() {
    Pair p;
    const double size = random_.size(-6, 6), size_b = random_.oneIn(2) ? size : random_.size(-6, 6);
    const auto corner = [&]() -> P {
      const double offset = random_.oneIn(2) ? 0. : size * random_.size(-1, 3);
      return random_.point() * offset;
    };
    p.a = random_.triangleAt(corner(), size);
    p.b = random_.triangleAt(corner(), size_b);
    p.tf1 = random_.pose(random_.oneIn(2) ? 0. : size);
    p.tf2.linear() = random_.rotation();
    const P away = random_.vectorOfSize((size + size_b) * random_.size(-5, 1));
    p.tf2.translation() = p.tf1 * P(p.a[0] + away) - p.tf2.linear() * p.b[0];
    if (random_.oneIn(3)) p.tf2.linear() = p.tf1.linear();  // parallel edges and faces
    return p;
  }

  RandomGeometry random_{13};
};

/// Along the line between any two points, the separation is a lower bound of the distance up to the
/// error stated.
TEST_F(Triangles, AlongALineItIsALowerBound) {
  int apart = 0;
  for (int round = 0; round < 30000; ++round) {
    const auto p = pair();
    auto separation = p.separation();
    EXPECT_EQ(fcl::Vector3d::Zero(), separation.direction()) << "before there is a line";
    const fcl::Vector3d from = p.a[std::size_t(round % 3)];
    fcl::Vector3d to = p.toFirst()(p.b[0]);
    if (random_.oneIn(2)) to = from + random_.direction() * (to - from).norm();
    separation.lookAlong(from, to);
    const Real distance = exact::distance(p.first(), p.second());
    apart += distance > 0;
    ASSERT_LE(Real(separation.separation(kOnly, kOnly)), distance + p.error()) << round;
  }
  EXPECT_GT(apart, 15000);
}

/// Along the line between the nearest points the separation is the distance: no bound could be
/// better, so that the next pair at this distance is not tested.
TEST_F(Triangles, AlongTheNearestPointsItIsTheDistance) {
  constexpr double kTolerance = 1e-13;
  for (int round = 0; round < 20000; ++round) {
    auto p = pair();
    for (auto* corners : {&p.a, &p.b})
      *corners = {random_.point(), random_.point(), random_.point()};
    p.tf1 = p.tf2 = random_.pose(10);
    p.tf2.translation() += random_.direction() * 4.5;  // 1 to 8 apart
    auto separation = p.separation();
    const TriangleGap gap = separation.gap(kOnly, kOnly);
    const auto distance = double(exact::distance(p.first(), p.second()));
    ASSERT_NEAR(distance, gap.distance, kTolerance) << round;
    separation.lookAlong(gap.points.first, gap.points.second);
    ASSERT_NEAR(distance, separation.separation(kOnly, kOnly), kTolerance) << round;
    ASSERT_NEAR(1, separation.direction().norm(), 4 * kEpsilon);
  }
}

/// Far from the origin, what is near the line's points is measured from there: the error goes by
/// the distance from the points, not by the coordinates.
TEST_F(Triangles, NearTheLinesPointsNoDigitIsLost) {
  for (int round = 0; round < 20000; ++round) {
    auto p = pair();
    p.tf1.setIdentity();
    p.tf2.setIdentity();
    const fcl::Vector3d far = random_.point() * 1e4;
    for (auto* corners : {&p.a, &p.b})
      for (auto& x : *corners) x = far + random_.point();
    auto separation = p.separation();
    separation.lookAlong(p.a[0], p.b[0]);
    ASSERT_LE(Real(separation.separation(kOnly, kOnly)),
              exact::distance(p.first(), p.second()) + 32 * Real(kEpsilon));
  }
}

/// A line between points that are equal, or so near that the square of their distance underflows,
/// is none.
TEST_F(Triangles, TheLineHasALengthOfOne) {
  const auto p = pair();
  auto separation = p.separation();
  const fcl::Vector3d zero = fcl::Vector3d::Zero();
  separation.lookAlong(zero, zero);
  EXPECT_EQ(zero, separation.direction());
  for (const double length : {0.7, 1.2, 1.5, 10.}) {
    separation.lookAlong(zero, fcl::Vector3d(0, length * kRoot, 0));
    const double found = separation.direction().norm();
    EXPECT_TRUE(found == 0 || std::abs(found - 1) < 1e-5) << found;
  }
}

}  // namespace triangle_separation_test
}  // namespace adaptive_bvh_test
