// Inflations: sums over many steps of all sizes, in which no step is lost.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/random_geometry.h"
#include "thesis/adaptive_tree.h"
#include "thesis/model_state.h"
#include "thesis/vertex_states.h"

namespace adaptive_bvh_test {
namespace inflations_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::Float4;
using adaptive_bvh::Inflations;
using adaptive_bvh::RefitPolicy;
using adaptive_bvh::ScaledFrame;
using adaptive_bvh::Volume;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
class InflationSums : public testing::Test {
 protected:
  RandomGeometryOf<S> random_{17};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(InflationSums, Scalars);

/// coordinateSum bounds the sum of the coordinates of a volume's corner and its radius through 10^6
/// moves of all sizes, and moving rounds by no more than roundingOfMove. The moves are those of
/// TranslationPropagation: a common translation, and a middle in single precision.
TYPED_TEST(InflationSums, MovingAVolumeRoundsByNoMoreThanStated) {
  using S = TypeParam;
  using V = Volume<fcl::RSS<S>>;
  auto& random = this->random_;
  fcl::RSS<S> bv = random.volume(1, 1);
  Inflations<S> bounds;
  bounds.reset(1);
  bounds.include(V::cornerSum(bv));
  const ScaledFrame<S> frame(fcl::Vector3<S>::Zero(), S(0.25));
  const S unit = frame.unit();
  Real worst = 0;
  for (int step = 0; step < manySteps(300000); ++step) {
    if (step % 5000 == 0) {  // a refit, somewhere: sums begin anew
      bv = random.volume(random.size(-3, 3), random.size(-6, 6));
      bounds.restart();
      bounds.include(V::cornerSum(bv));
    }
    const fcl::Vector3<S> displacement = random.vectorOfSize(random.size(-9, 2));
    const fcl::Vector3<S> common =
        random.oneIn(2) ? displacement * S(0.9) : fcl::Vector3<S>(0, 0, 0);
    const fcl::Vector3<S> rest = displacement - common;
    bounds.extend(rounding::norm(displacement), unit);
    const S allowed = bounds.roundingOfMove();

    const Float4 middle = frame.displacement(rest);
    exact::Point corner = exact::of(bv.To);
    for (int k = 0; k < 3; ++k) {
      corner[k] += Real(common[k]) + Real(middle[k]) * Real(unit);
      bv.To[k] += common[k] + S(middle[k]) * unit;
    }
    const auto spread = float(rest.norm() / unit) / 4;
    const Real radius = Real(bv.r) + Real(spread) * Real(unit) + Real(allowed);
    bv.r += S(spread) * unit + allowed;
    const Real lost = (corner - exact::of(bv.To)).norm() + std::abs(radius - Real(bv.r));
    const Real lost_before = (exact::of(displacement) - exact::of(common) - exact::of(rest)).norm();
    ASSERT_LE(lost + lost_before, Real(allowed)) << step;
    worst = std::max(worst, lost / Real(allowed));
    ASSERT_LE(Real(V::cornerSum(bv)), Real(bounds.coordinateSum()) * (1 + 1e-6L)) << step;
    ASSERT_LE(V::cornerSum(bv), bounds.coordinateSum()) << step;
  }
  EXPECT_GT(worst, 0.05) << "moves at which something is rounded must be among them";
}

/// The sum of coordinates grows by four times every largest displacement at least, and no step is
/// lost beside it; a step without motion leaves it.
TYPED_TEST(InflationSums, CoordinateSumLosesNoStep) {
  using S = TypeParam;
  Inflations<S> bounds;
  bounds.reset(1);
  bounds.include(S(3));
  bounds.include(S(2));
  EXPECT_EQ(S(3), bounds.coordinateSum()) << "of the largest volume";
  bounds.extend(0, 1);
  EXPECT_EQ(S(3), bounds.coordinateSum()) << "nothing moved";
  Real least = 3;
  for (int step = 0; step < manySteps(300000); ++step) {
    const S before = bounds.coordinateSum();
    const S largest = this->random_.size(-30, 1);
    bounds.extend(largest, 1);
    least += 4 * Real(largest);
    ASSERT_GT(bounds.coordinateSum(), before) << step;
    ASSERT_GE(Real(bounds.coordinateSum()), least) << step;
    if (step % 10000 == 9999) {
      bounds.restart();
      bounds.include(S(3));
      least = 3;
    }
  }
}

/// Inflations are kept by node, and stay where the sum of coordinates begins anew.
TYPED_TEST(InflationSums, InflationsAreKeptByNode) {
  using S = TypeParam;
  Inflations<S> inflations;
  inflations.reset(5);
  for (int node = 0; node < 5; ++node) EXPECT_EQ(0, inflations.of(node));
  for (int node = 0; node < 4; ++node) inflations.data()[node] = float(10 + node);
  inflations.set(4, 5);
  inflations.extend(100, 1);
  EXPECT_TRUE(inflations.needsRestart(1));
  EXPECT_FALSE(inflations.needsRestart(2));
  inflations.restart();
  EXPECT_FALSE(inflations.needsRestart(S(1e-6)));
  EXPECT_EQ(0, inflations.coordinateSum());
  const float expected[] = {10, 11, 12, 13, 5};
  for (int node = 0; node < 5; ++node) EXPECT_EQ(expected[node], inflations.of(node)) << node;
}

/// One vertex of a sheet moves, by 1e-12 to 10 of its sizes, alone or with its body, over and over.
/// The volumes above it, which are never refitted, hold it to the end, and the sum of coordinates
/// bounds them.
TYPED_TEST(InflationSums, VolumesThatAreNeverRefittedHoldAVertex) {
  using S = TypeParam;
  RefitPolicy policy;
  policy.criterion = FitnessCriterion::RefitNone;
  AdaptiveBVHModel<fcl::RSS<S>> model(policy);
  const TriangleMesh mesh = plate(1, 1);
  fillModel(mesh, model);
  const auto vertices = pointsIn<S>(mesh.vertices);
  const auto& tree = adaptive_bvh::detail::ModelAccess<fcl::RSS<S>>::tree(model);
  const unsigned vertex = 1;  // of one triangle only: its leaf and the root are above it
  const int leaf = model.getBV(1).primitiveId() == 0 ? 1 : 2;
  auto positions = vertices;
  int restarts = 0;
  for (int step = 0; step < manySteps(150000); ++step) {
    const fcl::Vector3<S> shift = this->random_.vectorOfSize(this->random_.size(-12, 0));
    positions[vertex] = vertices[vertex] + shift;
    for (unsigned v : {0u, 2u, 3u})  // with its body in every fourth step, and back in the next
      positions[v] = vertices[v] + (step % 4 == 1 ? shift : fcl::Vector3<S>(0, 0, 0));
    const S before = tree.inflations.coordinateSum();
    if (step % 4 == 0)
      model.update(std::vector<unsigned>{vertex}, {positions[vertex]});
    else
      model.update(positions);
    restarts += tree.inflations.coordinateSum() < before;
    for (const int node : {0, leaf}) {
      const fcl::RSS<S>& bv = model.getBV(node).bv;
      ASSERT_LE(exact::excess(bv, exact::of(positions[vertex])), 0) << step;
      ASSERT_LE(Volume<fcl::RSS<S>>::cornerSum(bv), tree.inflations.coordinateSum()) << step;
    }
  }
  EXPECT_EQ(0, model.lastUpdate().refitted());
  EXPECT_TRUE(restarts > 0 || tree.resets > 1) << "sums begin anew on the way";
}

}  // namespace inflations_test
}  // namespace adaptive_bvh_test
