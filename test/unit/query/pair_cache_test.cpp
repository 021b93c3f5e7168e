// The front that a distance query leaves: what it covers, that its bounds hold, when it is used,
// left off, and begun anew.
#include "query/pair_cache.h"

#include <gtest/gtest.h>

#include <set>

#include "model_state.h"
#include "support/brute_force.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace pair_cache_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FrontPair;
using adaptive_bvh::PairCache;
using adaptive_bvh::PlacedMesh;
using exact::Real;

template <typename S>
class Cache : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;
  using Model = AdaptiveBVHModel<BV>;
  using Pose = fcl::Transform3<S>;

  Cache() {
    sheet_ = plate<S>(8, 8);  // a trough, in which the hose lies: no plane separates them
    for (auto& p : sheet_.vertices) p[2] = 6 * (p[1] - S(0.5)) * (p[1] - S(0.5));
    fillModel(sheet_, first_);
    fillModel(tube<S>(8, 9), second_);
    for (Model* model : {&first_, &second_}) model->computeLocalAABB();
    above_.translation() = Vector3<S>(S(-0.4), S(0.5), S(0.6));
  }

  static PlacedMesh<BV> placed(const Model& model, const Pose& tf) {
    return {&model, &adaptive_bvh::detail::ModelAccess<BV>::tree(model), tf};
  }

  /// A query through the front; brute force judges the distance, unless it is left out.
  S ask(PairCache<BV>& cache, const Pose& tf, bool is_judged = true) {
    fcl::DistanceResult<S> result;
    const bool by_boxes = adaptive_bvh::distanceByBoxes<BV>(
        placed(first_, origin_), placed(second_, tf), {request_, result}, cache);
    EXPECT_TRUE(by_boxes);
    if (!is_judged) return result.min_distance;
    const S expected = BruteForce<S>(first_, origin_, second_, tf).distance();
    EXPECT_NEAR(expected, result.min_distance, kTolerance);
    return result.min_distance;
  }

  /// The whole front that such a query leaves; nothing when it leaves none.
  std::vector<FrontPair> frontAfter(PairCache<BV>& cache, const Pose& tf) {
    ask(cache, tf);
    return cache.front->size() > 0 ? cache.front->pairs() : std::vector<FrontPair>();
  }
  /// Until there is a front: nothing moves, so that it promises to pay.
  void askUntilThereIsAFront(PairCache<BV>& cache, const Pose& tf, int most = 3) {
    for (int i = 0; i < most && (i == 0 || cache.front->size() == 0); ++i) ask(cache, tf);
    EXPECT_GT(cache.front->size(), 0u);
  }
  static PairCache<BV> cacheWithFront() {
    PairCache<BV> cache;
    cache.front.emplace();
    return cache;
  }

  /// Triangles below a node.
  static std::vector<int> below(const Model& model, int node) {
    const auto& n = model.getBV(node);
    if (n.isLeaf()) return {n.primitiveId()};
    std::vector<int> triangles = below(model, n.leftChild());
    for (const int t : below(model, n.rightChild())) triangles.push_back(t);
    return triangles;
  }
  static exact::Triangle triangle(const Model& model, int t, const Pose& tf) {
    const fcl::Triangle& v = model.tri_indices[t];
    return exact::placement(tf)(exact::Triangle{exact::of(model.vertices[v[0]]),
                                                exact::of(model.vertices[v[1]]),
                                                exact::of(model.vertices[v[2]])});
  }

  /// Of triangles.
  int pairs() const { return first_.num_tris * second_.num_tris; }

  static constexpr double kTolerance = std::is_same<S, float>::value ? 1e-5 : 1e-12;
  Model first_, second_;
  TriangleMesh<S> sheet_;
  const fcl::DistanceRequest<S> request_;
  const Pose origin_ = Pose::Identity();
  Pose above_ = origin_;
  RandomGeometry<S> random_{41};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Cache, Scalars);

/// While both deform and move a little, every front covers each pair of triangles exactly once, and
/// what it says of a pair where a search stopped just now bounds the distance of all below.
TYPED_TEST(Cache, AFrontCoversAllPairsOfTrianglesAndItsBoundsHold) {
  using S = TypeParam;
  auto cache = this->cacheWithFront();
  fcl::Transform3<S> tf = this->above_;
  int kept = 0;
  std::vector<FrontPair> last;
  for (int step = 0; step < 80; ++step) {
    std::vector<Vector3<S>> moved = this->sheet_.vertices;
    for (auto& p : moved) p[2] += S(0.01) * std::sin(S(0.1) * S(step) + 5 * p[0]);
    this->first_.update(moved);
    tf.translation()[0] += S(0.001);
    const auto pairs = this->frontAfter(cache, tf);
    if (pairs.empty()) continue;
    std::set<std::pair<int, int>> covered;
    std::size_t count = 0;
    for (const FrontPair& pair : pairs) {
      const bool is_old = std::any_of(last.begin(), last.end(), [&](const FrontPair& old) {
        return old.node1 == pair.node1 && old.node2 == pair.node2 && old.bound == pair.bound;
      });
      kept += is_old;
      for (const int t1 : this->below(this->first_, pair.node1))
        for (const int t2 : this->below(this->second_, pair.node2)) {
          covered.emplace(t1, t2);
          ++count;
          if (is_old) continue;  // a bound of an earlier step
          const Real d = exact::distance(this->triangle(this->first_, t1, this->origin_),
                                         this->triangle(this->second_, t2, tf));
          ASSERT_LE(Real(pair.bound), d + Real(this->kTolerance) / 10) << step;
        }
    }
    ASSERT_EQ(std::size_t(this->pairs()), covered.size()) << step;
    ASSERT_EQ(covered.size(), count) << "each of them once";
    last = pairs;
  }
  EXPECT_GT(kept, 1000) << "most of a front lasts";
}

/// Nothing moved: the front settles every pair and stays as it is. It only grows finer otherwise.
TYPED_TEST(Cache, AFrontAtRestStays) {
  auto cache = this->cacheWithFront();
  this->askUntilThereIsAFront(cache, this->above_);
  const auto second = this->frontAfter(cache, this->above_);
  const auto third = this->frontAfter(cache, this->above_);
  ASSERT_EQ(second.size(), third.size());
  for (std::size_t i = 0; i < second.size(); ++i) {
    EXPECT_EQ(second[i].node1, third[i].node1);
    EXPECT_EQ(second[i].bound, third[i].bound);
  }
  EXPECT_EQ(third.size(), cache.front->size());
  EXPECT_GE(cache.front->bytes(), third.size() * sizeof(FrontPair));
  cache.front->clear();
  EXPECT_EQ(0u, cache.front->size());
}

/// Objects that leap so far that every bound runs out: no front is written, and the search does
/// what it does without one. A third pair asks first: what that brings up to date, both find so.
TYPED_TEST(Cache, WithoutEvidenceNoFrontIsWritten) {
  using S = TypeParam;
  auto with = this->cacheWithFront();
  PairCache<fcl::RSS<S>> without, before_both;
  fcl::Transform3<S> tf = this->above_;
  for (int step = 0; step < 60; ++step) {
    tf.translation()[0] = S(step % 2 ? -1.9 : 0.9);  // the hose is 2 long
    this->ask(before_both, tf);
    const long before = this->first_.recordedWork().box_tests;
    this->ask(with, tf);
    const long between = this->first_.recordedWork().box_tests;
    EXPECT_EQ(0u, with.front->size());
    this->ask(without, tf);
    EXPECT_EQ(this->first_.recordedWork().box_tests - between, between - before);
  }
}

/// Two steps at rest, a leap, two at rest, a leap, ...: each rest promises a front that pays, each
/// leap makes it worthless. Promises are believed ever more rarely. A longer rest has its
/// front.
TYPED_TEST(Cache, BrokenPromisesAreBelievedMoreRarely) {
  using S = TypeParam;
  auto cache = this->cacheWithFront();
  fcl::Transform3<S> tf = this->above_;
  int fronts = 0;
  for (int step = 0; step < 90; ++step) {
    tf.translation()[0] = S(step / 3 % 2 ? -1.9 : 0.9);
    this->ask(cache, tf);
    if (step % 3 == 2) fronts += cache.front->size() > 0;
  }
  EXPECT_GE(fronts, 1);
  EXPECT_LE(fronts, 20);
  this->askUntilThereIsAFront(cache, tf, 70);
}

/// A front that has grown fine is written anew: its size stays near that of a new one.
TYPED_TEST(Cache, AFrontThatGrewFineIsWrittenAnew) {
  using S = TypeParam;
  auto cache = this->cacheWithFront();
  fcl::Transform3<S> tf = this->above_;
  std::size_t largest = 0, last = 0;
  int shrunk = 0;
  for (int step = 0; step < 600; ++step) {
    tf.translation()[0] = this->above_.translation()[0] + S(0.3) * std::sin(S(0.002) * S(step));
    this->ask(cache, tf, step % 20 == 0);
    shrunk += cache.front->size() > 0 && cache.front->size() < last;
    if (cache.front->size() > 0) last = cache.front->size();
    largest = std::max(largest, last);
  }
  EXPECT_GT(shrunk, 0);
  EXPECT_LT(largest, std::size_t(this->pairs()) / 4);
}

/// Bounds of other trees mean nothing: after a rebuild of either, or for another pair.
TYPED_TEST(Cache, AFrontOfAnotherTreeIsDropped) {
  auto cache = this->cacheWithFront();
  const auto size_before_search = [&] {
    cache.front->moveTo(this->placed(this->first_, this->origin_),
                        this->placed(this->second_, this->above_));
    return cache.front->pairs().size();
  };
  for (auto* model : {&this->first_, &this->second_}) {
    this->askUntilThereIsAFront(cache, this->above_, 10);
    EXPECT_GT(size_before_search(), 0u) << "the same trees";
    fillModel(this->sheet_, *model);
    EXPECT_EQ(0u, size_before_search());
  }
}

/// A step so far that the sum of motions begins anew drops the front; so does a touch, at which the
/// search is left half way.
TYPED_TEST(Cache, AFrontEndsWithALongWayAndWithATouch) {
  using S = TypeParam;
  auto cache = this->cacheWithFront();
  this->askUntilThereIsAFront(cache, this->above_);
  fcl::Transform3<S> tf = this->above_;
  tf.translation()[2] = 0;
  EXPECT_LE(this->ask(cache, tf), 0) << "through the sheet";
  EXPECT_TRUE(cache.front->pairs().empty());
  this->askUntilThereIsAFront(cache, this->above_, 10);
  tf.translation()[2] = S(1e12);
  cache.front->moveTo(this->placed(this->first_, this->origin_), this->placed(this->second_, tf));
  EXPECT_TRUE(cache.front->pairs().empty());
}

/// The witness is the pair of triangles found last. Any other, also one that does not exist, costs
/// time and never the answer.
TYPED_TEST(Cache, AWitnessIsAHint) {
  using S = TypeParam;
  using BV = fcl::RSS<S>;
  PairCache<BV> cache;
  const S distance = this->ask(cache, this->above_);
  const Real witness = exact::distance(this->triangle(this->first_, cache.witness1, this->origin_),
                                       this->triangle(this->second_, cache.witness2, this->above_));
  EXPECT_NEAR(distance, S(witness), 1e-5);
  for (const int wrong : {0, 17, -1, 72, 1 << 30}) {
    cache.witness1 = wrong;
    cache.witness2 = 59 - wrong;
    EXPECT_EQ(distance, this->ask(cache, this->above_)) << wrong;
  }
}

/// Bodies near each other, both far from the world's origin: FCL takes the difference of their
/// translations, and so must the boxes.
TYPED_TEST(Cache, AnswersHoldFarFromTheWorldsOrigin) {
  using S = TypeParam;
  using BV = fcl::RSS<S>;
  for (int round = 0; round < 12; ++round) {
    const fcl::Transform3<S> tf1 = randomPose<S>(this->random_.engine(), S(3e6));
    fcl::Transform3<S> tf2 = tf1;
    tf2.linear() = randomPose<S>(this->random_.engine(), 0).linear();
    tf2.translation() += this->random_.direction() * 3;
    Real expected = std::numeric_limits<Real>::max();
    for (int t1 = 0; t1 < this->first_.num_tris; ++t1)
      for (int t2 = 0; t2 < this->second_.num_tris; ++t2)
        expected = std::min(expected, exact::distance(this->triangle(this->first_, t1, tf1),
                                                      this->triangle(this->second_, t2, tf2)));
    PairCache<BV> cache;
    fcl::DistanceResult<S> result;
    const bool by_boxes = adaptive_bvh::distanceByBoxes<BV>(this->placed(this->first_, tf1),
                                                            this->placed(this->second_, tf2),
                                                            {this->request_, result}, cache);
    ASSERT_TRUE(by_boxes);
    ASSERT_NEAR(S(expected), result.min_distance, this->kTolerance * 10) << round;
  }
}

/// So far apart that boxes in single precision will not do: nothing is done. A query that is
/// satisfied from the start is done.
TYPED_TEST(Cache, RefusesWhatBoxesCannotTell) {
  using S = TypeParam;
  using BV = fcl::RSS<S>;
  PairCache<BV> cache;
  fcl::Transform3<S> far = this->origin_;
  far.translation()[1] = S(1e25);
  fcl::DistanceResult<S> result;
  const auto first = this->placed(this->first_, this->origin_);
  const auto second = this->placed(this->second_, far);
  const auto ask = [&] {
    return adaptive_bvh::distanceByBoxes<BV>(first, second, {this->request_, result}, cache);
  };
  EXPECT_FALSE(ask());
  EXPECT_EQ(std::numeric_limits<S>::max(), result.min_distance);
  result.min_distance = -1;
  EXPECT_TRUE(ask());
  EXPECT_EQ(0, this->first_.recordedWork().box_tests);
}

}  // namespace pair_cache_test
}  // namespace adaptive_bvh_test
