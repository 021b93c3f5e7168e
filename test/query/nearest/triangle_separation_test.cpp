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

template <typename S>
class Triangles : public testing::Test {
 protected:
  using P = Vector3<S>;
  using Corners = std::array<P, 3>;

  /// Of any shape: general, a needle, a segment, a point, one along the axes.
  Corners triangle(S size, S offset) {
    const P p = random_.point() * offset, u = random_.vectorOfSize(size);
    P v = random_.vectorOfSize(size);
    const int kind = random_.below(8);
    if (kind == 0) v = u * S(0.3) + random_.point() * size * random_.size(-9, -2);
    if (kind == 1) v = u * S(0.3);
    if (kind == 2) v = u;
    return {p, p + u, kind == 3 ? p : P(p + v)};
  }

  struct Pair {
    Corners a, b;
    fcl::Transform3<S> tf1, tf2;

    RelativePlacement toFirst() const { return {tf1, tf2}; }
    TriangleSeparation<S> separation() const { return {a.data(), b.data(), toFirst()}; }
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
    const S size = random_.size(-6, 6), size_b = random_.oneIn(2) ? size : random_.size(-6, 6);
    const auto offset = [&] { return random_.oneIn(2) ? S(0) : size * random_.size(-1, 3); };
    p.a = triangle(size, offset());
    p.b = triangle(size_b, offset());
    p.tf1 = random_.pose(random_.oneIn(2) ? S(0) : size);
    p.tf2.linear() = random_.rotation();
    const P away = random_.vectorOfSize((size + size_b) * random_.size(-5, 1));
    p.tf2.translation() = p.tf1 * P(p.a[0] + away) - p.tf2.linear() * p.b[0];
    if (random_.oneIn(3)) p.tf2.linear() = p.tf1.linear();  // parallel edges and faces
    return p;
  }

  RandomGeometry<S> random_{13};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Triangles, Scalars);

/// Along the line between any two points, the separation is a lower bound of the distance up to the
/// error stated.
TYPED_TEST(Triangles, AlongALineItIsALowerBound) {
  int apart = 0;
  for (int round = 0; round < 30000; ++round) {
    const auto p = this->pair();
    auto separation = p.separation();
    EXPECT_EQ(fcl::Vector3d::Zero(), separation.direction()) << "before there is a line";
    const fcl::Vector3d from = p.a[std::size_t(round % 3)].template cast<double>();
    fcl::Vector3d to = p.toFirst()(p.b[0]);
    if (this->random_.oneIn(2))
      to = from + this->random_.direction().template cast<double>() * (to - from).norm();
    separation.lookAlong(from, to);
    const Real distance = exact::distance(p.first(), p.second());
    apart += distance > 0;
    ASSERT_LE(Real(separation.separation(kOnly, kOnly)), distance + p.error()) << round;
  }
  EXPECT_GT(apart, 15000);
}

/// Along the line between the nearest points the separation is the distance: no bound could be
/// better, so that the next pair at this distance is not tested.
TYPED_TEST(Triangles, AlongTheNearestPointsItIsTheDistance) {
  using S = TypeParam;
  constexpr double kTolerance = 1e-13;
  for (int round = 0; round < 20000; ++round) {
    auto p = this->pair();
    for (auto* corners : {&p.a, &p.b})
      *corners = {this->random_.point(), this->random_.point(), this->random_.point()};
    p.tf1 = p.tf2 = this->random_.pose(10);
    p.tf2.translation() += this->random_.direction() * S(4.5);  // 1 to 8 apart
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
TYPED_TEST(Triangles, NearTheLinesPointsNoDigitIsLost) {
  using S = TypeParam;
  for (int round = 0; round < 20000; ++round) {
    auto p = this->pair();
    p.tf1.setIdentity();
    p.tf2.setIdentity();
    const Vector3<S> far = this->random_.point() * S(1e4);
    for (auto* corners : {&p.a, &p.b})
      for (auto& x : *corners) x = far + this->random_.point();
    auto separation = p.separation();
    separation.lookAlong(p.a[0].template cast<double>(), p.b[0].template cast<double>());
    ASSERT_LE(Real(separation.separation(kOnly, kOnly)),
              exact::distance(p.first(), p.second()) + 32 * Real(kEpsilon));
  }
}

/// Along the middles and the normals it is a lower bound as well, whether or not it ends early; of
/// thin triangles, segments and points, too.
TYPED_TEST(Triangles, NearbyItIsALowerBound) {
  int positive = 0;
  for (int round = 0; round < 30000; ++round) {
    const auto p = this->pair();
    const auto separation = p.separation();
    const Real distance = exact::distance(p.first(), p.second());
    for (const double limit : {kLargest, double(distance / 4)}) {
      const double nearby = separation.separationNearby(kOnly, kOnly, limit);
      ASSERT_LE(Real(nearby), distance + p.error()) << round;
      positive += nearby > 0;
    }
  }
  EXPECT_GT(positive, 20000) << "-infinity would be a lower bound, too";
}

/// Above a face, that face's normal is the line: of either triangle, seen from either side.
TYPED_TEST(Triangles, NearbyFindsTheNormals) {
  using S = TypeParam;
  const RelativePlacement same;
  using P = Vector3<S>;
  const std::array<P, 3> face = {P(0, 0, 0), P(6, 0, 0), P(0, 6, 0)};
  for (const S side : {S(1), S(-1)}) {
    const std::array<P, 3> above = {P(2, 1, side), P(2, 3, 2 * side), P(0, 4, 3 * side)};
    const TriangleSeparation<S> there(face.data(), above.data(), same);
    const TriangleSeparation<S> back(above.data(), face.data(), same);
    EXPECT_DOUBLE_EQ(1, there.separationNearby(kOnly, kOnly, kLargest));
    EXPECT_DOUBLE_EQ(1, back.separationNearby(kOnly, kOnly, kLargest));
  }
}

/// A triangle so thin that the square of its normal underflows has no direction to look along.
TYPED_TEST(Triangles, HoldForTrianglesOfHardlyAnyArea) {
  using S = TypeParam;
  using P = Vector3<S>;
  const RelativePlacement same;
  const S root = S(std::max(kRoot, double(std::numeric_limits<S>::denorm_min())));
  for (const S height : {S(0.7), S(1.2), S(1.5), S(2.3), S(10)}) {
    const std::array<P, 3> thin = {P(0, 0, 0), P(1, 0, 0), P(0, height * root, 0)};
    const std::array<P, 3> above = {P(S(0.3), 0, 1), P(S(0.5), 0, 1), P(S(0.4), S(0.1), 1)};
    for (const bool first : {true, false}) {
      const auto& a = first ? thin : above;
      const auto& b = first ? above : thin;
      const TriangleSeparation<S> separation(a.data(), b.data(), same);
      EXPECT_LE(separation.separationNearby(kOnly, kOnly, kLargest), 1.00001) << height;
    }
  }
}

/// A line between points that are equal, or so near that the square of their distance underflows,
/// is none.
TYPED_TEST(Triangles, TheLineHasALengthOfOne) {
  const auto p = this->pair();
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
