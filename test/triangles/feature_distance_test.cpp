// Distances of a vertex and a face, and of two edges, against long double.
#include "triangles/feature_distance.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace feature_distance_test {

using exact::Real;

class Features : public testing::Test {
 protected:
  using P = fcl::Vector3d;

  /// Four corners of one pair: in general position, or two or three of them on a line, near one, or
  /// in one place; the edges 0-1 and 2-3 parallel, or nearly.
  std::array<P, 4> corners(double size, double offset) {
    const P at = random_.point() * offset;
    std::array<P, 4> c;
    for (P& x : c) x = at + random_.vectorOfSize(size);
    const double nearly = random_.oneIn(2) ? 0. : size * random_.size(-9, -2);
    switch (random_.below(8)) {
      case 0: c[3] = c[2] + (c[1] - c[0]) * random_.uniform() + random_.point() * nearly; break;
      case 1: c[3] = c[2] + random_.point() * nearly; break;
      case 2: c[3] = c[1] + (c[2] - c[1]) * random_.uniform() + random_.point() * nearly; break;
      case 3: c[1] = c[2] = c[3]; break;
      case 4: c[0] = (c[1] + c[2] + c[3]) / 3. + random_.point() * nearly; break;
      default: break;
    }
    return c;
  }
  static double extent(const std::array<P, 4>& c) {
    double largest = 0;
    for (const P& a : c)
      for (const P& b : c) largest = std::max(largest, (a - b).norm());
    return largest;
  }
  /// Adds a tested distance; R: the extent of its corners.
  void expect(const adaptive_bvh::FeatureDistance& found, Real exact, Real R, Real coordinate) {
    const Real u = std::numeric_limits<double>::epsilon() / 2;
    ASSERT_LE(std::abs(found.difference().template cast<Real>().norm() - Real(found.distance)),
              8 * u * R + 8 * u * coordinate);
    ASSERT_GE(Real(found.distance), exact - 16 * u * R);
    ASSERT_LE(Real(found.distance), exact + 4 * std::sqrt(u) * R);
    good_ += Real(found.distance) <= exact + 16 * u * R;
    ++all_;
  }

  RandomGeometry random_{17};
  int good_ = 0, all_ = 0;
};

/// The distance is right within the error stated, of faces of any shape; and in nearly all cases as
/// exact as for a good face.
TEST_F(Features, VertexAndFace) {
  using P = fcl::Vector3d;
  for (int round = 0; round < 60000; ++round) {
    const double size = this->random_.size(-4, 4);
    const auto c = this->corners(size, this->random_.oneIn(2) ? 0. : 10 * size);
    const std::array<P, 3> face = {c[1], c[2], c[3]};
    const auto found = adaptive_bvh::vertexFaceDistance(c[0], face);
    const exact::Triangle t = {exact::of(c[1]), exact::of(c[2]), exact::of(c[3])};
    const Real expected = exact::distance(t, exact::of(c[0]));
    this->expect(found, expected, this->extent(c), c[0].norm() + this->extent(c));
    EXPECT_EQ(c[0], found.first);
    ASSERT_LE(exact::distance(t, exact::of(found.second)),
              8 * std::numeric_limits<double>::epsilon() * (c[0].norm() + this->extent(c)));
  }
  EXPECT_GT(this->good_, this->all_ * 0.98);
}

/// Of edges at any angle, and of points.
TEST_F(Features, EdgeAndEdge) {
  using P = fcl::Vector3d;
  for (int round = 0; round < 60000; ++round) {
    const double size = this->random_.size(-4, 4);
    const auto c = this->corners(size, this->random_.oneIn(2) ? 0. : 10 * size);
    const auto found = adaptive_bvh::edgeEdgeDistance({c[0], c[1]}, {c[2], c[3]});
    const Real expected =
        exact::distance(exact::of(c[0]), exact::of(c[1]), exact::of(c[2]), exact::of(c[3]));
    const Real coordinate = c[0].norm() + this->extent(c);
    this->expect(found, expected, this->extent(c), coordinate);
    const P on[2] = {found.first, found.second};
    for (int i = 0; i < 2; ++i)
      ASSERT_LE((exact::nearestOnSegment(exact::of(c[std::size_t(2 * i)]),
                                         exact::of(c[std::size_t(2 * i + 1)]), exact::of(on[i])) -
                 exact::of(on[i]))
                    .norm(),
                8 * std::numeric_limits<double>::epsilon() * coordinate);
  }
  EXPECT_GT(this->good_, this->all_ * 0.98);
}

/// The six regions around a face and the inside, by hand.
TEST_F(Features, RegionsOfAFace) {
  using P = fcl::Vector3d;
  const std::array<P, 3> face = {P(0, 0, 0), P(4, 0, 0), P(0, 4, 0)};
  const auto distance = [&](const P& x) {
    return adaptive_bvh::vertexFaceDistance(x, face).distance;
  };
  EXPECT_FLOAT_EQ(2, float(distance({1, 1, 2})));
  EXPECT_FLOAT_EQ(0, float(distance({1, 1, 0})));
  EXPECT_FLOAT_EQ(5, float(distance({-3, -4, 0})));
  EXPECT_FLOAT_EQ(5, float(distance({8, -3, 0})));
  EXPECT_FLOAT_EQ(5, float(distance({-3, 8, 0})));
  EXPECT_FLOAT_EQ(5, float(distance({2, -3, 4})));
  EXPECT_FLOAT_EQ(5, float(distance({-3, 2, 4})));
  EXPECT_FLOAT_EQ(std::sqrt(8.f), float(distance({4, 4, 0})));
}

}  // namespace feature_distance_test
}  // namespace adaptive_bvh_test
