// What TrianglePairs4 calls certain, FCL's test says; and it is so in long double.
#include "triangles/triangle_pairs.h"

#include <gtest/gtest.h>

#include <fcl/narrowphase/detail/traversal/collision/intersect.h>

#include "boxes/wide_tree.h"
#include "query/pair_corners.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "triangles/triangle_gap.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh_test {
namespace triangle_pairs_test {

using adaptive_bvh::Float4;
using adaptive_bvh::PairError;
using adaptive_bvh::PairVerdicts;
using adaptive_bvh::TriangleDifferences;
using adaptive_bvh::TrianglePairs4;
using adaptive_bvh::TrianglePoints;
using adaptive_bvh::Vector4x3;
using exact::Real;

/// Four pairs of triangles of one body.
struct Group {
  TrianglePoints p[4], q[4];
  double extent;         ///< of the body, from its origin
  fcl::Vector3d origin;  ///< where the body is
  fcl::Matrix3d axes;    ///< of its coordinates

  double scale() const { return std::ldexp(1., -std::ilogb(double(extent))); }

  /// In the coordinates of a four-wide tree: positions, or what rounding took off them.
  Vector4x3 corner(const TrianglePoints (&triangles)[4], std::size_t c, bool residuals) const {
    const adaptive_bvh::RoundedCoordinates coordinates(
        adaptive_bvh::BodyCoordinates(axes, origin, scale()));
    Float4 rounded[4], residual[4];
    for (std::size_t k = 0; k < 4; ++k) coordinates(triangles[k][c], rounded[k], residual[k]);
    const Float4(&at)[4] = residuals ? residual : rounded;
    return adaptive_bvh::float4::columns(at[0], at[1], at[2], at[3]);
  }
  TrianglePairs4 coarse() const {
    return TrianglePairs4({corner(p, 0, false), corner(p, 1, false), corner(p, 2, false)},
                          {corner(q, 0, false), corner(q, 1, false), corner(q, 2, false)});
  }
  TrianglePairs4 precise() const {
    return TrianglePairs4({corner(p, 0, false), corner(p, 1, false), corner(p, 2, false)},
                          {corner(p, 0, true), corner(p, 1, true), corner(p, 2, true)},
                          {corner(q, 0, false), corner(q, 1, false), corner(q, 2, false)},
                          {corner(q, 0, true), corner(q, 1, true), corner(q, 2, true)});
  }
  TrianglePairs4 fine() const {
    TriangleDifferences differences(scale());
    for (int k = 0; k < 4; ++k) differences.set(k, p[k], q[k]);
    return differences.pairs();
  }
  PairError error(float position) const {
    return {position, adaptive_bvh::kDifferenceError, adaptive_bvh::leastProduct(scale(), 12)};
  }
  PairError preciseError() const { return error(2 * adaptive_bvh::WideTree::kResidualError); }
  PairError coarseError() const { return error(adaptive_bvh::WideTree::kPositionError); }
};

class Pairs4 : public testing::Test {
 protected:
  using P = fcl::Vector3d;

  /// Of any shape: general, a needle, a segment, a point.
  TrianglePoints triangle(const P& at, double size) {
    const P u = random_.vectorOfSize(size);
    P v = random_.vectorOfSize(size);
    const int kind = random_.below(16);
    if (kind == 0) v = u * 0.3 + random_.point() * size * random_.size(-9, -2);
    if (kind == 1) v = u * 0.3;
    if (kind == 2) v = u;
    if (kind == 3) return {at, at, at};
    return {at, at + u, at + v};
  }
  static P inside(const TrianglePoints& t, double a, double b) {
    return t[0] + a * (t[1] - t[0]) + b * (1 - a) * (t[2] - t[0]);
  }

  /// How the second lies to the first.
  TrianglePoints beside(const TrianglePoints& p, double size) {
    TrianglePoints q = triangle(p[0], size * random_.size(-1, 0.5));
    const P onto = inside(p, random_.uniform(0, 1), random_.uniform(0, 1));
    P shift = onto - inside(q, random_.uniform(0, 1), random_.uniform(0, 1));
    switch (random_.below(8)) {
      case 0: shift = p[std::size_t(random_.below(3))] - q[0]; break;  // a corner in common
      case 1: shift = onto - q[0]; break;                              // a corner on it
      case 2:                                                          // nearly the same
        q = p;
        shift = random_.point() * size * random_.size(-9, 0);
        break;
      case 3:  // the neighbour over an edge, or just beside it
        q = {p[1], p[0], P(p[0] + p[1] - p[2])};
        shift = random_.point() * size * random_.size(-9, 0);
        break;
      case 4: shift += random_.direction() * size * random_.size(-9, -1); break;
      default: shift += random_.point() * size * double(random_.below(3)); break;
    }
    for (P& x : q) x += shift;
    return q;
  }

  Group group(double least_size) {
    Group g;
    g.extent = random_.size(least_size, 6);
    g.origin = random_.point() * g.extent * (random_.oneIn(2) ? 0. : random_.size(0, 3));
    g.axes = random_.rotation();
    for (int k = 0; k < 3; ++k) g.axes.col(k).normalize();
    const double smallest = random_.oneIn(3) ? -7 : -3;
    for (int k = 0; k < 4; ++k) {
      const double size = 0.05 * g.extent * random_.size(smallest, 0);
      g.p[k] = triangle(g.origin + random_.point() * g.extent * 0.2, size);
      g.q[k] = beside(g.p[k], size);
    }
    return g;
  }

  static exact::Triangle exactOf(const TrianglePoints& t) {
    return {exact::of(t[0]), exact::of(t[1]), exact::of(t[2])};
  }
  static bool fclSays(const TrianglePoints& a, const TrianglePoints& b) {
    return fcl::detail::Intersect<double>::intersect_Triangle(a[0], a[1], a[2], b[0], b[1], b[2]);
  }

  RandomGeometry random_{41};
};

/// Apart: never where FCL finds an intersection, nor where there is one. Touching: only where both
/// do.
TEST_F(Pairs4, WhatIsCertainIsSo) {
  int apart = 0, residuals_apart = 0, touching = 0, by_planes = 0, pairs_apart = 0,
      pairs_touching = 0;
  for (int round = 0; round < manySteps(6000); ++round) {
    const auto g = this->group(-6);
    const TrianglePairs4 coarse = g.coarse(), precise = g.precise(), fine = g.fine();
    const unsigned planes =
        coarse.apartByPlanes(g.coarseError()) | coarse.apartByEdgeNormals(g.coarseError()) |
        precise.apartByPlanes(g.preciseError()) | precise.apartByEdgeNormals(g.preciseError());
    const PairVerdicts all = coarse.verdicts(g.coarseError()), sharp = fine.verdicts(g.error(0)),
                       residual = precise.verdicts(g.preciseError());
    for (int k = 0; k < 4; ++k) {
      const auto has = [&](unsigned bits) { return (bits >> k & 1) != 0; };
      const bool fcl_says = this->fclSays(g.p[k], g.q[k]);
      const bool ours_says = adaptive_bvh::touch(g.p[k], g.q[k]);
      const bool surely_apart = has(planes | all.apart | sharp.apart | residual.apart);
      const bool surely_touching = has(all.touching | sharp.touching | residual.touching);
      ASSERT_FALSE(surely_apart && fcl_says) << round << " planes " << has(planes) << " all "
                                             << has(all.apart) << " sharp " << has(sharp.apart);
      ASSERT_TRUE(!surely_touching || (fcl_says && ours_says)) << round;
      const bool exactly = exact::distance(this->exactOf(g.p[k]), this->exactOf(g.q[k])) <= 0;
      ASSERT_FALSE(surely_apart && exactly) << round;
      pairs_apart += !ours_says;
      pairs_touching += ours_says;
      by_planes += has(planes);
      apart += has(sharp.apart);
      touching += has(sharp.touching);
      residuals_apart += has(residual.apart);
    }
  }
  // Most are certain, though the pairs were chosen to be hard.
  EXPECT_GT(by_planes, pairs_apart / 4) << pairs_apart;
  EXPECT_GT(apart, pairs_apart / 2) << pairs_apart;
  EXPECT_GT(residuals_apart, apart * 98 / 100) << "as certain as by the model's own positions";
  EXPECT_GT(touching, pairs_touching / 5) << pairs_touching;
}

/// With a reach: "apart" only of what is farther.
TEST_F(Pairs4, WhatIsFartherIsSo) {
  int farther = 0, apart = 0, nearly = 0, surely_farther = 0, doubtful = 0;
  const auto seenFrom = [](const exact::Point& from, exact::Triangle t) -> exact::Triangle {
    for (exact::Point& x : t) x -= from;
    return t;
  };
  for (int round = 0; round < manySteps(6000); ++round) {
    const auto g = this->group(-6);
    const int judged = this->random_.below(4);
    const Real scale = Real(g.scale());
    const Real of_judged =
        scale * exact::distance(this->exactOf(g.p[judged]), this->exactOf(g.q[judged]));
    const double factor =
        this->random_.oneIn(2) ? 1 + this->random_.size(-6, 0) : this->random_.uniform(0, 1);
    const auto withReach = [&](PairError error) -> PairError {
      error.distance = static_cast<float>(double(of_judged) * factor);
      return error;
    };
    const PairError rough = withReach(g.coarseError()), fine = withReach(g.preciseError());
    const TrianglePairs4 coarse = g.coarse(), precise = g.precise();
    const unsigned bits = coarse.apartByPlanes(rough) | coarse.apartByEdgeNormals(rough) |
                          coarse.verdicts(rough).apart | precise.apartByPlanes(fine) |
                          precise.apartByEdgeNormals(fine) | precise.verdicts(fine).apart;
    for (int k = 0; k < 4; ++k) {
      const Real distance = scale * exact::distance(this->exactOf(g.p[k]), this->exactOf(g.q[k]));
      const bool is_apart = (bits >> k & 1) != 0;
      ASSERT_TRUE(!is_apart || distance > Real(fine.distance)) << round << " " << k;
      farther += distance > Real(fine.distance);
      // In double precision.
      const double reach = double(Real(fine.distance) / scale);
      const TrianglePoints p = g.p[k], q = g.q[k];
      const bool surely = adaptive_bvh::areSurelyFarther(p, q, reach);
      const exact::Point from = exact::of(g.p[k][0]);
      const Real precisely = exact::distance(seenFrom(from, this->exactOf(g.p[k])),
                                             seenFrom(from, this->exactOf(g.q[k])));
      // Of needles the oracle now and then finds an edge to pierce a face that it passes.
      const bool is_doubtful = precisely == 0 && !adaptive_bvh::touch(p, q);
      ASSERT_TRUE(!surely || is_doubtful || precisely > Real(reach)) << round << " " << k;
      doubtful += is_doubtful;
      surely_farther += surely;
      apart += is_apart;
      nearly += is_apart && distance < Real(fine.distance) * 1.5L;
    }
  }
  EXPECT_GT(apart, farther / 3) << farther;
  EXPECT_GT(nearly, manySteps(150));
  EXPECT_GT(surely_farther, apart);
  EXPECT_LT(doubtful, 4 * manySteps(6000) / 100);
}

/// So small that FCL's products underflow.
TEST_F(Pairs4, NothingIsCertainWhereFclUnderflows) {
  const double smallest = -110;
  int fcl_says_touching = 0;
  for (int round = 0; round < 4000; ++round) {
    auto g = this->group(-6);
    const double size = this->random_.size(smallest, -4);
    const double factor = size / g.extent;
    const auto shrink = [&](TrianglePoints& t) {
      for (auto& x : t) x = (x - g.origin) * factor;
    };
    for (int k = 0; k < 4; ++k) {
      shrink(g.p[k]);
      shrink(g.q[k]);
    }
    g.origin.setZero();
    g.extent = size;
    const PairVerdicts all = g.coarse().verdicts(g.coarseError()),
                       sharp = g.fine().verdicts(g.error(0)),
                       residual = g.precise().verdicts(g.preciseError());
    const unsigned planes =
        g.coarse().apartByPlanes(g.coarseError()) | g.coarse().apartByEdgeNormals(g.coarseError());
    for (int k = 0; k < 4; ++k) {
      const bool fcl_says = this->fclSays(g.p[k], g.q[k]);
      fcl_says_touching += fcl_says;
      ASSERT_FALSE(((planes | all.apart | sharp.apart | residual.apart) >> k & 1) != 0 && fcl_says)
          << round;
      ASSERT_TRUE(((all.touching | sharp.touching | residual.touching) >> k & 1) == 0 || fcl_says)
          << round;
    }
  }
  EXPECT_GT(fcl_says_touching, 1000);
}

}  // namespace triangle_pairs_test
}  // namespace adaptive_bvh_test
