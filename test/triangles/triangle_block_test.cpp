// TriangleBlock against the distances of its triangles in long double.
#include "triangles/triangle_block.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace triangle_block_test {

using adaptive_bvh::Float4;
using adaptive_bvh::TriangleBlock;
using adaptive_bvh::Triangles4;
using adaptive_bvh::TriangleSides;
using adaptive_bvh::Vector4x3;
using exact::Real;
using P = fcl::Vector3d;
using Corners = std::array<P, 3>;

class Block : public testing::Test {
 protected:
  /// Of any shape: general, a needle, a segment, a point.
  Corners triangle(double size, const P& at) {
    const P p = at + random_.point() * size, u = random_.vectorOfSize(size);
    P v = random_.vectorOfSize(size);
    const int kind = random_.below(8);
    if (kind == 0) v = u * 0.3 + random_.point() * size * random_.size(-9, -2);
    if (kind == 1) v = u * 0.3;
    return {p, p + u, kind == 2 ? p : P(p + v)};
  }
  static exact::Triangle exactly(const Corners& t) {
    return {exact::of(t[0]), exact::of(t[1]), exact::of(t[2])};
  }

  /// Four and four triangles, `away` from each other, seen from the first corner of q.
  struct Sample {
    Corners p[4], q[4];
    double scale;

    std::array<Float4, 4> bounds(const P& line, float* slack = nullptr) const {
      Triangles4 a, b;
      for (int i = 0; i < 4; ++i) {
        a.set(i, p[i], q[0][0], scale);
        b.set(i, q[i], q[0][0], scale);
      }
      const Vector4x3 along = adaptive_bvh::vectors::all(line);
      const TriangleSides p_side(a, along), q_side(b, along);
      const TriangleBlock block(p_side, q_side);
      if (slack) *slack = block.slack();
      return {block.bounds<0>(), block.bounds<1>(), block.bounds<2>(), block.bounds<3>()};
    }
    Real distance(int i, int j) const { return exact::distance(exactly(p[i]), exactly(q[j])); }
  };
  Sample sample() {
    Sample s;
    const double size = random_.size(-6, 6);
    s.scale = std::ldexp(1., -std::ilogb(size));
    const P at = random_.point() * size * random_.size(-1, 5), away = random_.vectorOfSize(size);
    const double apart = random_.oneIn(3) ? 0 : random_.size(-4, 1);
    for (int i = 0; i < 4; ++i) {
      s.p[i] = triangle(size, at);
      s.q[i] = triangle(size, at + away * apart);
    }
    return s;
  }

  RandomGeometry random_{23};
};

/// Whatever line it is given, no bound exceeds the distance: but for what double precision rounds
/// off where positions are far from the frame's origin.
TEST_F(Block, BoundsNeverExceedTheDistance) {
  int positive = 0, apart = 0;
  for (int round = 0; round < manySteps(2000); ++round) {
    const Sample s = sample();
    const auto bounds = s.bounds(round % 4 ? random_.direction() : P(P::Zero()));
    Real coordinates = 0;
    for (const Corners& t : {s.p[0], s.q[0]})
      coordinates = std::max(coordinates, exact::of(t[0]).lpNorm<1>());
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const Real d = s.distance(i, j);
        const Real bound = Real(bounds[std::size_t(j)][i]) / Real(s.scale);
        ASSERT_LE(bound, d + 2 * Real(std::numeric_limits<double>::epsilon()) * coordinates)
            << round;
        apart += d > 0;
        positive += bound > d / 2;
      }
  }
  EXPECT_GT(positive, apart / 2) << "-infinity would be a lower bound, too";
}

/// Along the line between the nearest points the bound is the distance, but for the slack.
TEST_F(Block, AlongTheNearestPointsTheyAreTheDistance) {
  for (int round = 0; round < 2000; ++round) {
    Sample s = sample();
    for (int i = 0; i < 4; ++i) {  // above one another: the line is the normal of a face
      const double h = random_.size(-3, 0) / s.scale, w = 1 / s.scale;
      const P o = s.q[0][0];
      s.q[i] = {o, o + P(w, 0, 0), o + P(0, w, 0)};
      s.p[i] = {o + P(w / 5, w / 5, h), o + P(w, 0, h + w), o + P(0, w, h + w / 2)};
    }
    float slack;
    const auto bounds = s.bounds(-P::UnitZ(), &slack);
    EXPECT_LT(slack, 1e-4f);
    for (int i = 0; i < 4; ++i)
      ASSERT_GE(Real(bounds[1][i] + slack) / Real(s.scale), s.distance(i, 1) * (1 - 1e-5L))
          << round;
  }
}

/// Triangles so small that squares of their normals underflow have no normals; bounds hold.
TEST_F(Block, HoldWhereSquaresUnderflow) {
  for (const double w : {1e-5, 1e-8, 1e-12, 1e-18, 1e-25, 1e-40}) {
    Sample s;
    s.scale = 1;
    for (int i = 0; i < 4; ++i) {
      s.q[i] = {P(0, 0, 0), P(w, 0, 0), P(0, w, 0)};
      s.p[i] = {P(w / 5, w / 5, w), P(w, 0, 2 * w), P(0, w, 3 * w)};
    }
    for (const Float4& row : s.bounds(P::Zero()))
      for (int i = 0; i < 4; ++i) ASSERT_LE(Real(row[i]), s.distance(i, 0)) << w;
  }
}

}  // namespace triangle_block_test
}  // namespace adaptive_bvh_test
