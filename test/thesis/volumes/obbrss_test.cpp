// The box of an OBBRSS: fits hold their triangles, and it grows and moves at least as it must, with
// axes that are off by rounding. Against numbers that are finer than the volume's. (Its swept
// sphere is that of an RSS: rss_test.)
#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "thesis/adaptive_tree.h"
#include "thesis/volumes/kept_axes.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh_test {
namespace obbrss_test {

using adaptive_bvh::Inflations;
using adaptive_bvh::MeshView;
using adaptive_bvh::Volume;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
class Obbrss : public testing::Test {
 protected:
  using P = fcl::Vector3<S>;
  using BV = fcl::OBBRSS<S>;
  using V = Volume<BV>;

  /// Corners of triangles of one kind: general, needle, collinear, two or three equal, in a plane
  /// along the axes, in any plane; of a size, and off the origin.
  std::vector<P> corners(int kind, int triangles, S scale, S offset) {
    std::vector<P> points;
    const P shift = random_.point() * offset, a = random_.point(), b = random_.point();
    for (int t = 0; t < triangles; ++t) {
      P p = random_.point(), q = random_.point(), r = random_.point();
      if (kind == 1) r = p + (q - p) * S(0.3) + random_.point() * S(1e-6);
      if (kind == 2) r = p + (q - p) * S(0.3);
      if (kind == 3) r = q;
      if (kind == 4) q = r = p;
      if (kind == 5) p[2] = q[2] = r[2] = S(0.5);
      if (kind == 6) p = a * p[0] + b * p[1], q = a * q[0] + b * q[1], r = a * r[0] + b * r[1];
      for (const P& corner : {p, q, r}) points.push_back(corner * scale + shift);
    }
    return points;
  }

  static BV fit(const std::vector<P>& points, const std::vector<P>* previous = nullptr) {
    std::vector<fcl::Triangle> triangles;
    std::vector<unsigned> order;
    for (unsigned v = 0; v < points.size(); v += 3) {
      order.push_back(unsigned(triangles.size()));
      triangles.emplace_back(v, v + 1, v + 2);
    }
    MeshView<S> view;
    view.vertices = points.data();
    view.previous = previous ? previous->data() : nullptr;
    view.triangles = triangles.data();
    return V::fit(view, order.data(), int(order.size()));
  }

  /// Axes whose lengths and angles are off by as much as the bounds allow for.
  fcl::Matrix3<S> frame() {
    fcl::Matrix3<S> axes = random_.rotation();
    for (int k = 0; k < 3; ++k) axes.col(k) += random_.point() * (V::kAxes / 8);
    return axes;
  }

  RandomGeometryOf<S> random_{23};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Obbrss, Scalars);

TYPED_TEST(Obbrss, FitsHoldEveryCornerExactly) {
  using S = TypeParam;
  int corners = 0;
  for (int round = 0; round < 60; ++round)
    for (int kind = 0; kind < 7; ++kind)
      for (int count : {1, 2, 3, 40})
        for (S scale : {S(1e-12), S(1e-3), S(1), S(1e6)})
          for (S offset : {S(0), S(1), S(1e6)}) {
            const auto points = this->corners(kind, count, scale, offset);
            const auto bv = this->fit(points);
            for (const auto& p : points) {
              ASSERT_LE(exact::excess(bv.obb, exact::of(p)), 0) << "kind " << kind << ", " << count;
              ASSERT_TRUE(Volume<fcl::OBBRSS<S>>::contains(bv, p));
              ++corners;
            }
            const exact::Matrix axes = exact::of(bv.obb.axis);
            const Real askew =
                (axes.transpose() * axes - exact::Matrix::Identity()).cwiseAbs().maxCoeff();
            ASSERT_LE(askew, Real(Volume<fcl::OBBRSS<S>>::kAxes)) << "what the bounds assume";
            ASSERT_EQ(bv.obb.axis, bv.rss.axis);
          }
  EXPECT_GT(corners, 500000);
}

TYPED_TEST(Obbrss, FitsHoldBothFramesOfATwoFrameUpdate) {
  using S = TypeParam;
  for (int round = 0; round < 500; ++round) {
    const int count = 1 + round % 3;
    const auto now = this->corners(0, count, 1, 1), before = this->corners(0, count, 1, 1);
    const fcl::OBBRSS<S> bv = this->fit(now, &before);
    for (const auto* frame : {&now, &before})
      for (const auto& p : *frame) EXPECT_LE(exact::excess(bv.obb, exact::of(p)), 0);
  }
}

/// The axes of a refit in single precision, for needles of any thinness, too.
TYPED_TEST(Obbrss, AxesAlongNeedlesAreOrthonormal) {
  auto& random = this->random_;
  for (int round = 0; round < manySteps(20000); ++round) {
    const fcl::Vector3<TypeParam> along = random.vectorOfSize(random.size(-3, 1));
    const fcl::Vector3<TypeParam> aside =
        along * random.uniform() + random.vectorOfSize(random.size(-12, 0));
    namespace vectors = adaptive_bvh::vectors;
    const auto axes = adaptive_bvh::axesAlong(vectors::all(along), vectors::all(aside));
    exact::Matrix frame;
    int k = 0;
    for (const auto* axis : {&axes.x, &axes.y, &axes.z})
      frame.col(k++) << axis->x[0], axis->y[0], axis->z[0];
    ASSERT_LE((frame.transpose() * frame - exact::Matrix::Identity()).cwiseAbs().maxCoeff(), 1e-6L);
    ASSERT_GT(frame.determinant(), 0);
  }
}

/// The box touches its points on all six sides, but for the term of rounding.
TYPED_TEST(Obbrss, FitsAreTight) {
  using S = TypeParam;
  for (int round = 0; round < 500; ++round) {
    const auto points = this->corners(round % 7, 1 + round % 30, 1, 1);
    const fcl::OBB<S> box = this->fit(points).obb;
    const exact::Matrix axes = exact::of(box.axis);
    for (int k = 0; k < 3; ++k)
      for (const Real side : {-1, 1}) {
        Real farthest = -1e9L;
        for (const auto& p : points)
          farthest = std::max(farthest, side * axes.col(k).dot(exact::of(p) - exact::of(box.To)));
        EXPECT_GE(farthest,
                  Real(box.extent[k]) - 100 * Real(rounding::epsilon<S>()) *
                                            (Real(box.extent.sum()) + Real(box.To.norm())));
      }
  }
}

/// Half of FCL's own boxes are smaller, half are larger: ours are not much larger in the mean.
TYPED_TEST(Obbrss, BoxesAreAboutAsTightAsFcls) {
  using S = TypeParam;
  double ours = 0, fcls = 0;
  for (int round = 0; round < 400; ++round) {
    auto points = this->corners(round % 2 ? 6 : 0, 2 + round % 17, 1, 1);
    const fcl::Vector3<S> mine = this->fit(points).obb.extent;
    fcl::OBB<S> box;
    fcl::fit(points.data(), int(points.size()), box);
    const auto area = [](const fcl::Vector3<S>& e) {
      return double(e[0] * e[1] + e[1] * e[2] + e[2] * e[0]);
    };
    ours += area(mine);
    fcls += area(box.extent);
  }
  EXPECT_LE(ours, 1.1 * fcls);
}

/// Points at the corners and on the sides of a box with axes as bad as assumed, moved by what a
/// step allows, mostly straight along an axis: the moved box holds them, over chains of steps.
TYPED_TEST(Obbrss, AMovedBoxHoldsItsMovedPoints) {
  using S = TypeParam;
  using V = Volume<fcl::OBBRSS<S>>;
  auto& random = this->random_;
  fcl::OBBRSS<S> bv;
  Inflations<S> bounds;
  std::vector<exact::Point> points;
  for (int step = 0; step < manySteps(60000); ++step) {
    if (step % 100 == 0) {
      const S size = random.size(-3, 3);
      bv.rss = random.volume(size, random.size(-6, 6));
      bv.obb.axis = bv.rss.axis = this->frame();
      bv.obb.To = bv.rss.To;
      for (int k = 0; k < 3; ++k) bv.obb.extent[k] = random.oneIn(3) ? 0 : random.uniform(0, size);
      points.clear();
      for (int i = 0; i < 8; ++i) {  // its corners, by either reading
        const exact::Point corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        const exact::Point sums = exact::of(bv.obb.extent).cwiseProduct(corner);
        const exact::Matrix axes = exact::of(bv.obb.axis);
        const exact::Point a = axes * sums, b = axes.transpose().inverse() * sums;
        const exact::Point least = a * (1 - 3 * Real(V::kAxes));  // within both readings
        points.push_back(exact::of(bv.obb.To) +
                         (random.oneIn(2) ? least : exact::Point(b * (1 - 3 * Real(V::kAxes)))));
      }
      bounds.restart();
      bounds.include(V::cornerSum(bv));
      for (auto& p : points)
        if (exact::excess(bv.obb, p) > 0) p = exact::of(bv.obb.To);
    }
    // d = c + e, |e| <= h; the largest |d| is what a step may say of itself.
    const fcl::Vector3<S> c = random.vectorOfSize(random.size(-6, 1));
    const S h = random.oneIn(3) ? S(0) : random.size(-6, 1);
    bounds.extend(rounding::sum(rounding::norm(c), h), S(0));
    const S allowed = bounds.roundingOfMove();
    for (auto& p : points) {
      exact::Point direction = exact::of(bv.obb.axis).col(random.below(3)).normalized();
      if (random.oneIn(3)) direction = exact::of(random.direction()).normalized();
      p += exact::of(c) + direction * (Real(h) * (random.oneIn(2) ? 1 : -1));
    }
    V::move(bv, c, h + allowed);
    for (const auto& p : points) ASSERT_LE(exact::excess(bv.obb, p), 0) << step;
    ASSERT_LE(V::cornerSum(bv), bounds.coordinateSum()) << step;
  }
}

/// A radius that goes up and down takes the box along: it never grew by less, with room for its
/// axes, and after many times by hardly more.
TYPED_TEST(Obbrss, ExtentsFollowTheRadius) {
  using S = TypeParam;
  using V = Volume<fcl::OBBRSS<S>>;
  auto& random = this->random_;
  for (int round = 0; round < 300; ++round) {
    fcl::OBBRSS<S> bv;
    bv.rss = random.volume(random.size(-6, 3), 1);
    bv.obb.axis = bv.rss.axis;
    bv.obb.To = bv.rss.To;
    for (int k = 0; k < 3; ++k) bv.obb.extent[k] = random.oneIn(3) ? S(0) : random.size(-6, 3);
    const fcl::OBBRSS<S> fitted = bv;
    Real most = Real(bv.rss.r);
    constexpr int kTimes = 300;
    for (int i = 0; i < kTimes; ++i) {
      V::setRadius(bv, rounding::sum(fitted.rss.r, random.size(-9, 2)));
      if (random.oneIn(9)) V::raiseRadius(bv);
      const Real growth = Real(bv.rss.r) - Real(fitted.rss.r);
      most = std::max(most, Real(bv.rss.r));
      for (int k = 0; k < 3; ++k) {
        const Real least = Real(fitted.obb.extent[k]) + growth * (1 + 2 * Real(V::kAxes));
        ASSERT_GE(Real(bv.obb.extent[k]) + Real(std::nextafter(bv.rss.r, S(1e30)) - bv.rss.r),
                  least)
            << i;
        ASSERT_LE(Real(bv.obb.extent[k]), least + (i + 1) * 200 * Real(rounding::epsilon<S>()) *
                                                      (most + Real(fitted.obb.extent[k])));
      }
    }
  }
}

TYPED_TEST(Obbrss, SumsBoundBothParts) {
  using S = TypeParam;
  using V = Volume<fcl::OBBRSS<S>>;
  using Swept = Volume<fcl::RSS<S>>;
  for (int round = 0; round < 20000; ++round) {
    const S size = this->random_.size(-6, 6);
    fcl::OBBRSS<S> bv;
    bv.rss = this->random_.volume(size, size * this->random_.size(-2, 2));
    bv.obb.axis = this->frame();
    bv.obb.To = this->random_.vectorOfSize(size);
    for (int k = 0; k < 3; ++k) bv.obb.extent[k] = size * this->random_.uniform(0, 1);
    ASSERT_GE(V::cornerSum(bv), Swept::cornerSum(bv.rss));
    ASSERT_GE(V::cornerSum(bv), bv.obb.To.template lpNorm<1>() + bv.obb.extent.maxCoeff());
    ASSERT_GE(V::coordinateSum(bv), Swept::coordinateSum(bv.rss));
    for (int i = 0; i < 8; ++i) {
      const exact::Point corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
      const exact::Point x = exact::of(bv.obb.To) +
                             exact::of(bv.obb.axis) * exact::of(bv.obb.extent).cwiseProduct(corner);
      ASSERT_LE(x.template lpNorm<1>(),
                Real(V::coordinateSum(bv)) * (1 + 8 * Real(rounding::epsilon<S>())));
    }
  }
}

/// Each of the thirty numbers is one of the volume's, and no other's.
TYPED_TEST(Obbrss, NumbersAreAllOfTheVolume) {
  using S = TypeParam;
  using V = Volume<fcl::OBBRSS<S>>;
  static_assert(sizeof(fcl::OBBRSS<S>) == V::kNumbers * sizeof(S), "nothing else is in it");
  fcl::OBBRSS<S> bv;
  for (int i = 0; i < V::kNumbers; ++i) V::number(bv, i) = S(i + 1);
  std::vector<S> found(reinterpret_cast<S*>(&bv), reinterpret_cast<S*>(&bv) + V::kNumbers);
  std::sort(found.begin(), found.end());
  for (int i = 0; i < V::kNumbers; ++i) EXPECT_EQ(S(i + 1), found[std::size_t(i)]);
  EXPECT_EQ(S(15), bv.rss.r);
}

}  // namespace obbrss_test
}  // namespace adaptive_bvh_test
