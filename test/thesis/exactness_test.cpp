// Every query on an adaptive model answers as brute force does, in every frame, whatever the
// policy.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/names.h"

namespace adaptive_bvh_test {
namespace exactness_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

constexpr FitnessCriterion kCriteria[] = {
    FitnessCriterion::A,      FitnessCriterion::B,        FitnessCriterion::AB,
    FitnessCriterion::BC,     FitnessCriterion::ABC,      FitnessCriterion::AOrBC,
    FitnessCriterion::ABOrBC, FitnessCriterion::RefitAll, FitnessCriterion::RefitNone};

const int kFrames = manySteps(50);
const int kFewFrames = manySteps(20);

/// Rounding of one distance between bodies of size about 1: FCL's own rectangle and triangle
/// distances err by some 1e-15 (double) and some 1e-6 (float) there.
double tolerance() { return 1e-12; }

/// An adaptive model and a plain one of FCL's, which follow the same deformation.
template <typename BV>
struct Body {
  Body(const TriangleMesh& mesh, typename Deformation::Kind kind, const RefitPolicy& policy,
       unsigned seed)
      : adaptive(policy), deformation(mesh, kind, seed) {
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, adaptive));
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, plain));
  }

  void advance(int frame) {
    const std::vector<fcl::Vector3d>& positions = deformation.next();
    if (frame % 2 == 0) {
      adaptive.update(positions);
    } else {
      ASSERT_EQ(fcl::BVH_OK, adaptive.beginReplaceModel());
      ASSERT_EQ(fcl::BVH_OK, adaptive.replaceSubModel(positions));
      ASSERT_EQ(fcl::BVH_OK, adaptive.endReplaceModel());
    }
    plain.beginReplaceModel();
    plain.replaceSubModel(positions);
    plain.endReplaceModel(true, false);  // top-down: FCL's sound refit
    std::string reason;
    ASSERT_TRUE(adaptive.validate(&reason)) << reason;  // also the mesh
  }

  AdaptiveBVHModel<BV> adaptive;
  fcl::BVHModel<BV> plain;
  Deformation deformation;
};

using Geometry = fcl::CollisionGeometryd;

/// The pairs of triangles in a result; FCL stores up to two contact points a pair.
std::set<std::pair<int, int>> pairsOf(const fcl::CollisionResultd& result) {
  std::set<std::pair<int, int>> pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    pairs.emplace(result.getContact(i).b1, result.getContact(i).b2);
  return pairs;
}

struct Tally {
  int queries = 0, touching = 0, recorded = 0;
};

/// fcl::collide would copy both models of RSS.
void collideByFcl(const AdaptiveBVHModel<fcl::RSSd>& a, const fcl::Transform3d& tf1,
                  const AdaptiveBVHModel<fcl::RSSd>& b, const fcl::Transform3d& tf2,
                  const fcl::CollisionRequestd& request, fcl::CollisionResultd& result) {
  fcl::detail::orientedMeshCollide<fcl::detail::MeshCollisionTraversalNodeRSS<double>, fcl::RSSd>(
      &a, tf1, &b, tf2, request, result);
}
void collideByFcl(const AdaptiveBVHModel<fcl::OBBRSSd>& a, const fcl::Transform3d& tf1,
                  const AdaptiveBVHModel<fcl::OBBRSSd>& b, const fcl::Transform3d& tf2,
                  const fcl::CollisionRequestd& request, fcl::CollisionResultd& result) {
  fcl::collide(&a, tf1, &b, tf2, request, result);
}

template <typename BV>
void compareOnce(const Body<BV>& a, const Body<BV>& b, adaptive_bvh::CoherentDistance& coherent,
                 int frame, std::mt19937& random, Tally& tally) {
  const fcl::Transform3d tf1 =
      frame % 5 == 0 ? fcl::Transform3d::Identity() : randomPose(random, 0.6);
  const fcl::Transform3d tf2 = randomPose(random, 0.8);
  const Geometry* ga = &a.adaptive;
  const Geometry* gb = &b.adaptive;
  const BruteForce brute(a.adaptive, tf1, b.adaptive, tf2);

  const double expected = brute.distance();
  const fcl::DistanceRequestd request(true);
  fcl::DistanceResultd plain_result, drop_in, recorded;
  fcl::distance(static_cast<const Geometry*>(&a.plain), tf1, static_cast<const Geometry*>(&b.plain),
                tf2, request, plain_result);
  fcl::distance(ga, tf1, gb, tf2, request, drop_in);
  EXPECT_NEAR(expected, plain_result.min_distance, tolerance());
  EXPECT_NEAR(expected, drop_in.min_distance, tolerance());
  if (frame % 5 == 0) {
    fcl::DistanceResultd followed;
    coherent.distance(tf1, tf2, request, followed);
    EXPECT_NEAR(expected, followed.min_distance, tolerance());
    const BruteForce of_meshes(a.adaptive.mesh(), tf1, b.adaptive.mesh(), tf2);
    EXPECT_EQ("", of_meshes.findError(followed, tf1, tolerance()));
  }
  const bool record = frame % 4 != 3;  // every fourth step records no statistics
  if (record) {
    adaptive_bvh::distance(ga, tf1, gb, tf2, request, recorded);
    EXPECT_NEAR(expected, recorded.min_distance, tolerance());
    EXPECT_EQ("", brute.findError(recorded, tf1, tolerance()));
    EXPECT_EQ(1, a.adaptive.recordedWork().queries);
    ++tally.recorded;
  }

  const std::set<std::pair<int, int>> contacts = brute.contacts();
  fcl::CollisionRequestd all(std::numeric_limits<int>::max(), true);
  fcl::CollisionResultd collision;
  if (record) {
    adaptive_bvh::collide(ga, tf1, gb, tf2, all, collision);
  } else {
    collideByFcl(a.adaptive, tf1, b.adaptive, tf2, all, collision);
  }
  EXPECT_EQ(contacts, pairsOf(collision));

  ++tally.queries;
  tally.touching += !contacts.empty();
}

template <typename BV>
Tally run(const RefitPolicy& policy, typename Deformation::Kind kind, unsigned seed, int frames) {
  std::mt19937 random(testSeed(seed));
  const TriangleMesh pairs[][2] = {{plate(4, 4), dome(8, 3)},
                                   {tube(5, 6), plate(5, 3)},
                                   {soup(20, random), tube(4, 4)},
                                   {dome(10, 4), plate(6, 6)}};
  Tally tally;
  for (const auto& pair : pairs) {
    Body<BV> a(pair[0], kind, policy, testSeed(seed + 1)),
        b(pair[1], kind, policy, testSeed(seed + 2));
    adaptive_bvh::CoherentDistance coherent(a.adaptive.mesh(), b.adaptive.mesh());
    for (int frame = 0; frame < frames && !testing::Test::HasFailure(); ++frame) {
      a.advance(frame);
      if (frame < frames / 2) b.advance(frame);  // then b stands still, like a finished body
      compareOnce(a, b, coherent, frame, random, tally);
    }
  }
  return tally;
}

/// The nine criteria: as the thesis sets them in smooth motion, with the default propagation in
/// jerky motion.
class Exactness : public testing::TestWithParam<FitnessCriterion> {
 protected:
  template <typename BV>
  void check(int frames) {
    Tally total;
    for (auto kind : {Deformation::Kind::Smooth, Deformation::Kind::Jerky}) {
      RefitPolicy own;
      own.criterion = GetParam();
      const RefitPolicy policy =
          kind == Deformation::Kind::Smooth ? RefitPolicy::thesis(GetParam()) : own;
      const Tally tally = run<BV>(policy, kind, 100 + unsigned(GetParam()), frames);
      total.queries += tally.queries;
      total.touching += tally.touching;
      total.recorded += tally.recorded;
    }
    // The nine criteria and two volumes together: 5,040 (model pair, frame) queries.
    EXPECT_EQ(2 * 4 * frames, total.queries);
    EXPECT_GT(total.touching, total.queries / 20) << "the poses must meet often enough";
    EXPECT_LT(total.touching, total.queries * 19 / 20);
    EXPECT_GT(total.recorded, total.queries / 2);
    RecordProperty("queries", total.queries);
    RecordProperty("touching", total.touching);
  }
};

TEST_P(Exactness, Double) { check<fcl::RSSd>(kFrames); }
TEST_P(Exactness, DoubleOBBRSS) { check<fcl::OBBRSSd>(kFewFrames); }

INSTANTIATE_TEST_SUITE_P(AllCriteria, Exactness, testing::ValuesIn(kCriteria));

/// Sizes beyond the quick ones above: 162 and 1,800 triangles a body, fewer frames.
TEST(ExactnessLarge, MorePlatesAndHoses) {
  std::mt19937 random(testSeed(7));
  const auto smooth = Deformation::Kind::Smooth;
  for (const int size : {9, 30}) {
    Body<fcl::RSSd> a(plate(size, size), smooth, RefitPolicy(), 1);
    Body<fcl::RSSd> b(tube(size, size), smooth, RefitPolicy(), 2);
    adaptive_bvh::CoherentDistance coherent(a.adaptive.mesh(), b.adaptive.mesh());
    Tally tally;
    for (int frame = 0; frame < manySteps(size == 9 ? 20 : 2); ++frame) {
      a.advance(frame);
      b.advance(frame);
      compareOnce(a, b, coherent, frame, random, tally);
    }
  }
}

}  // namespace exactness_test
}  // namespace adaptive_bvh_test
