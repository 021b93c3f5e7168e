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
template <typename S>
S tolerance() {
  return std::is_same<S, float>::value ? S(1e-5) : S(1e-12);
}

/// An adaptive model and a plain one of FCL's, which follow the same deformation.
template <typename BV>
struct Body {
  using S = typename BV::S;

  Body(const TriangleMesh<S>& mesh, typename Deformation<S>::Kind kind, const RefitPolicy& policy,
       unsigned seed)
      : adaptive(policy), deformation(mesh, kind, seed) {
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, adaptive));
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, plain));
  }

  void advance(int frame) {
    const std::vector<Vector3<S>>& positions = deformation.next();
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
  Deformation<S> deformation;
};

template <typename S>
using Geometry = fcl::CollisionGeometry<S>;

/// The pairs of triangles in a result; FCL stores up to two contact points a pair.
template <typename S>
std::set<std::pair<int, int>> pairsOf(const fcl::CollisionResult<S>& result) {
  std::set<std::pair<int, int>> pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    pairs.emplace(result.getContact(i).b1, result.getContact(i).b2);
  return pairs;
}

struct Tally {
  int queries = 0, touching = 0, recorded = 0;
};

/// fcl::collide would copy both models of RSS.
template <typename S>
void collideByFcl(const AdaptiveBVHModel<fcl::RSS<S>>& a, const fcl::Transform3<S>& tf1,
                  const AdaptiveBVHModel<fcl::RSS<S>>& b, const fcl::Transform3<S>& tf2,
                  const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  fcl::detail::orientedMeshCollide<fcl::detail::MeshCollisionTraversalNodeRSS<S>, fcl::RSS<S>>(
      &a, tf1, &b, tf2, request, result);
}
template <typename S>
void collideByFcl(const AdaptiveBVHModel<fcl::OBBRSS<S>>& a, const fcl::Transform3<S>& tf1,
                  const AdaptiveBVHModel<fcl::OBBRSS<S>>& b, const fcl::Transform3<S>& tf2,
                  const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  fcl::collide<S>(&a, tf1, &b, tf2, request, result);
}

template <typename BV>
void compareOnce(const Body<BV>& a, const Body<BV>& b,
                 adaptive_bvh::CoherentDistance<typename BV::S>& coherent, int frame,
                 std::mt19937& random, Tally& tally) {
  using S = typename BV::S;
  const fcl::Transform3<S> tf1 =
      frame % 5 == 0 ? fcl::Transform3<S>::Identity() : randomPose<S>(random, S(0.6));
  const fcl::Transform3<S> tf2 = randomPose<S>(random, S(0.8));
  const Geometry<S>* ga = &a.adaptive;
  const Geometry<S>* gb = &b.adaptive;
  const BruteForce<S> brute(a.adaptive, tf1, b.adaptive, tf2);

  const S expected = brute.distance();
  const fcl::DistanceRequest<S> request(true);
  fcl::DistanceResult<S> plain_result, drop_in, recorded;
  fcl::distance(static_cast<const Geometry<S>*>(&a.plain), tf1,
                static_cast<const Geometry<S>*>(&b.plain), tf2, request, plain_result);
  fcl::distance(ga, tf1, gb, tf2, request, drop_in);
  EXPECT_NEAR(expected, plain_result.min_distance, tolerance<S>());
  EXPECT_NEAR(expected, drop_in.min_distance, tolerance<S>());
  if (frame % 5 == 0) {
    fcl::DistanceResult<S> followed;
    coherent.distance(tf1, tf2, request, followed);
    EXPECT_NEAR(expected, followed.min_distance, tolerance<S>());
    const BruteForce<S> of_meshes(a.adaptive.mesh(), tf1, b.adaptive.mesh(), tf2);
    EXPECT_EQ("", of_meshes.findError(followed, tf1, tolerance<S>()));
  }
  const bool record = frame % 4 != 3;  // every fourth step records no statistics
  if (record) {
    adaptive_bvh::distance(ga, tf1, gb, tf2, request, recorded);
    EXPECT_NEAR(expected, recorded.min_distance, tolerance<S>());
    EXPECT_EQ("", brute.findError(recorded, tf1, tolerance<S>()));
    EXPECT_EQ(1, a.adaptive.recordedWork().queries);
    ++tally.recorded;
  }

  const std::set<std::pair<int, int>> contacts = brute.contacts();
  fcl::CollisionRequest<S> all(std::numeric_limits<int>::max(), true);
  fcl::CollisionResult<S> collision;
  if (record) {
    adaptive_bvh::collide(ga, tf1, gb, tf2, all, collision);
  } else {
    collideByFcl(a.adaptive, tf1, b.adaptive, tf2, all, collision);
  }
  EXPECT_EQ(contacts, pairsOf(collision));

  ++tally.queries;
  tally.touching += !contacts.empty();
}

template <typename BV, typename S = typename BV::S>
Tally run(const RefitPolicy& policy, typename Deformation<S>::Kind kind, unsigned seed,
          int frames) {
  std::mt19937 random(testSeed(seed));
  const TriangleMesh<S> pairs[][2] = {{plate<S>(4, 4), dome<S>(8, 3)},
                                      {tube<S>(5, 6), plate<S>(5, 3)},
                                      {soup<S>(20, random), tube<S>(4, 4)},
                                      {dome<S>(10, 4), plate<S>(6, 6)}};
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
    using S = typename BV::S;
    Tally total;
    for (auto kind : {Deformation<S>::Kind::Smooth, Deformation<S>::Kind::Jerky}) {
      RefitPolicy own;
      own.criterion = GetParam();
      const RefitPolicy policy =
          kind == Deformation<S>::Kind::Smooth ? RefitPolicy::thesis(GetParam()) : own;
      const Tally tally = run<BV>(policy, kind, 100 + unsigned(GetParam()), frames);
      total.queries += tally.queries;
      total.touching += tally.touching;
      total.recorded += tally.recorded;
    }
    // The ten criteria, two volumes and two scalars together: 7,520 (model pair, frame) queries.
    EXPECT_EQ(2 * 4 * frames, total.queries);
    EXPECT_GT(total.touching, total.queries / 20) << "the poses must meet often enough";
    EXPECT_LT(total.touching, total.queries * 19 / 20);
    EXPECT_GT(total.recorded, total.queries / 2);
    RecordProperty("queries", total.queries);
    RecordProperty("touching", total.touching);
  }
};

TEST_P(Exactness, Double) { check<fcl::RSSd>(kFrames); }
/// FCL's float is compiled without optimisation: two minutes with all frames.
TEST_P(Exactness, Float) { check<fcl::RSSf>(kFewFrames); }
TEST_P(Exactness, DoubleOBBRSS) { check<fcl::OBBRSSd>(kFewFrames); }

INSTANTIATE_TEST_SUITE_P(AllCriteria, Exactness, testing::ValuesIn(kCriteria));

using ExactnessOfFloat = Exactness;
TEST_P(ExactnessOfFloat, OBBRSS) { check<fcl::OBBRSSf>(kFewFrames); }

INSTANTIATE_TEST_SUITE_P(SomeCriteria, ExactnessOfFloat,
                         testing::Values(FitnessCriterion::AOrBC, FitnessCriterion::AB));

/// Sizes beyond the quick ones above: 162 and 1,800 triangles a body, fewer frames.
TEST(ExactnessLarge, MorePlatesAndHoses) {
  std::mt19937 random(testSeed(7));
  const auto smooth = Deformation<double>::Kind::Smooth;
  for (const int size : {9, 30}) {
    Body<fcl::RSSd> a(plate<double>(size, size), smooth, RefitPolicy(), 1);
    Body<fcl::RSSd> b(tube<double>(size, size), smooth, RefitPolicy(), 2);
    adaptive_bvh::CoherentDistanced coherent(a.adaptive.mesh(), b.adaptive.mesh());
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
