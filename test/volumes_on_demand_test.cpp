// RefitPolicy::volumes_on_demand and volumes_rest: our queries are exact while FCL's nodes wait,
// and the first query that reads the nodes finds them up to date, whatever happened since the
// update. Those that rest contain their triangles all the time.
#include <gtest/gtest.h>

#include <limits>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <octomap/octomap.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/broadphase.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "model_state.h"
#include "support/brute_force.h"
#include "support/exact_geometry.h"

namespace adaptive_bvh_test {
namespace volumes_on_demand_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::CoherentDistance;
using adaptive_bvh::RefitPolicy;
using Points = std::vector<Vector3<double>>;
using Pairs = std::set<std::pair<int, int>>;

template <typename BV>
class OnDemand : public testing::Test {
 protected:
  using Model = AdaptiveBVHModel<BV>;
  using Plain = fcl::BVHModel<BV>;

  OnDemand() {
    beside_.translation() = Vector3<double>(-0.6, 0.3, 0.45);
    for (Model* model : {&a_, &b_}) model->setRefitPolicy(onDemand(true));
    fillModel(sheet_, a_);
    fillModel(tube<double>(6, 8), b_);
    std::mt19937 random(8);
    std::uniform_real_distribution<double> one(-0.15, 0.15);
    for (std::size_t v = 0; v < sheet_.vertices.size(); ++v)
      creases_.emplace_back(one(random), one(random), one(random));
  }

  static RefitPolicy onDemand(bool wait) {
    RefitPolicy policy;
    policy.volumes_on_demand = wait;
    return policy;
  }
  static const fcl::Transform3d& still() {
    static const fcl::Transform3d identity = fcl::Transform3d::Identity();
    return identity;
  }

  /// The sheet is crumpled, goes through itself, and turns.
  const Points& nextPositions() {
    const Points& wave = wave_.next();
    const fcl::Matrix3d turn =
        Eigen::AngleAxisd(0.3 * ++steps_, fcl::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    now_.clear();
    for (std::size_t v = 0; v < wave.size(); ++v) now_.push_back(turn * (wave[v] + creases_[v]));
    return now_;
  }
  void update() { a_.update(nextPositions()); }

  /// Whether every node holds every vertex of its triangles, of both frames of a two-frame update.
  static bool holdsAll(const Plain& model) {
    for (int i = 0; i < model.getNumBVs(); ++i)
      if (!holds(model, i, i)) return false;
    return true;
  }
  static bool holds(const Plain& model, int volume, int node) {
    const auto& below = model.getBV(node);
    if (!below.isLeaf())
      return holds(model, volume, below.leftChild()) && holds(model, volume, below.rightChild());
    for (int k = 0; k < 3; ++k) {
      const std::size_t v = model.tri_indices[below.primitiveId()][k];
      for (const Vector3<double>* vertices : {model.vertices, model.prev_vertices})
        if (vertices && exact::excess(model.getBV(volume).bv, exact::of(vertices[v])) > 0)
          return false;
    }
    return true;
  }
  static void expectUpToDate(const Model& model) {
    EXPECT_TRUE(holdsAll(model));
    std::string reason;
    EXPECT_TRUE(model.validate(&reason)) << reason;
  }

  double bruteDistance() const { return BruteForce<double>(a_, still(), b_, beside_).distance(); }
  double ourDistance() const {
    fcl::DistanceResultd result;
    return adaptive_bvh::distance<double>(&a_, still(), &b_, beside_, fcl::DistanceRequestd(),
                                          result);
  }
  double fclDistance() const {
    fcl::DistanceResultd result;
    return fcl::distance<double>(&a_, still(), &b_, beside_, fcl::DistanceRequestd(), result);
  }

  /// Of the sheet with itself: all that brute force finds, whichever triangle comes first, and no
  /// other.
  void expectSelfCollisions() const {
    fcl::CollisionResultd result;
    selfCollide(a_, fcl::CollisionRequestd(100000), result);
    Pairs found;
    for (std::size_t i = 0; i < result.numContacts(); ++i)
      found.insert(std::minmax(int(result.getContact(i).b1), int(result.getContact(i).b2)));
    const Pairs touching = BruteForce<double>(a_, still(), a_, still()).contacts();
    for (int i = 0; i < a_.num_tris; ++i)
      for (int j = i + 1; j < a_.num_tris; ++j) {
        if (shareAVertex(a_.tri_indices[i], a_.tri_indices[j])) continue;
        EXPECT_EQ(touching.count({i, j}), found.count({i, j}));
        self_contacts_ += int(touching.count({i, j}));
      }
  }
  static bool shareAVertex(const fcl::Triangle& s, const fcl::Triangle& t) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (s[i] == t[j]) return true;
    return false;
  }

  /// Whether the boxes wait as well.
  bool boxesWait() const {
    return !adaptive_bvh::detail::ModelAccess<BV>::tree(a_).boxesAreCurrent();
  }
  void expectContacts() const {
    fcl::CollisionResultd found;
    adaptive_bvh::collide<double>(&a_, still(), &b_, beside_, fcl::CollisionRequestd(100000),
                                  found);
    EXPECT_EQ(BruteForce<double>(a_, still(), b_, beside_).contacts().size(), found.numContacts());
  }

  const TriangleMesh<double> sheet_ = plate<double>(7, 7);
  Model a_, b_;
  fcl::Transform3d beside_ = fcl::Transform3d::Identity();
  Deformation<double> wave_{sheet_, Deformation<double>::Kind::Smooth, 4};
  Points creases_, now_;
  int steps_ = 0;
  mutable int self_contacts_ = 0;
};

using Volumes = testing::Types<fcl::RSSd, fcl::OBBRSSd>;
TYPED_TEST_SUITE(OnDemand, Volumes);

/// Ours answer from the boxes, and leave the nodes behind.
TYPED_TEST(OnDemand, OurQueriesAreExactWhileVolumesWait) {
  CoherentDistance<TypeParam> pair(this->a_, this->b_);
  for (int step = 0; step < 10; ++step) {
    this->update();
    const auto& report = this->a_.lastUpdate();
    EXPECT_EQ(0, report.moved + report.inflated + report.refitted());
    const double expected = this->bruteDistance();
    EXPECT_NEAR(expected, this->ourDistance(), 1e-12);
    fcl::DistanceResultd result;
    EXPECT_NEAR(expected,
                pair.distance(this->still(), this->beside_, fcl::DistanceRequestd(), result),
                1e-12);
    this->expectSelfCollisions();
    ASSERT_FALSE(this->holdsAll(this->a_)) << "nothing waits";
  }
  EXPECT_GT(this->self_contacts_, 20);
}

/// Who asks for contacts only does not pay for the boxes; the first query that reads them lets them
/// follow.
TYPED_TEST(OnDemand, BoxesWaitForTheFirstQueryThatReadsThem) {
  for (int step = 0; step < 4; ++step) this->update();
  EXPECT_TRUE(this->boxesWait());
  this->expectSelfCollisions();
  this->expectContacts();
  EXPECT_TRUE(this->boxesWait());
  EXPECT_NEAR(this->bruteDistance(), this->ourDistance(), 1e-12);
  EXPECT_FALSE(this->boxesWait());
  for (int step = 0; step < 4; ++step) {
    this->update();
    EXPECT_FALSE(this->boxesWait()) << "somebody asks for them in every step";
    this->ourDistance();
  }
  this->update();
  this->update();
  EXPECT_TRUE(this->boxesWait());
}

/// Updates of every kind and queries of every kind, in any order.
TYPED_TEST(OnDemand, EveryQueryIsExactAfterEveryUpdate) {
  CoherentDistance<TypeParam> pair(this->a_, this->b_);
  adaptive_bvh::CoherentProximity<TypeParam> proximity(this->a_, this->b_);
  std::mt19937 random(21);
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  int waited = 0;
  for (int step = 0; step < 400; ++step) {
    if (step % 50 == 0) this->a_.setRefitPolicy(this->onDemand(step % 100 == 0));
    const Points& next = this->nextPositions();
    switch (below(8)) {
      case 0: {
        const std::vector<unsigned> some = {3, unsigned(below(60)), unsigned(below(60))};
        this->a_.update(some, {next[some[0]], next[some[1]], next[some[2]]});
        break;
      }
      case 1:
        this->a_.beginUpdateModel();
        this->a_.updateSubModel(next);
        ASSERT_EQ(fcl::BVH_OK, this->a_.endUpdateModel());
        break;
      case 2: {
        Points wrong = next;
        wrong[5][1] = std::numeric_limits<double>::infinity();
        EXPECT_THROW(this->a_.update(wrong), std::invalid_argument);
        break;
      }
      default: this->a_.update(next);
    }
    waited += this->boxesWait();
    const double expected = this->bruteDistance();
    switch (below(12)) {
      case 0: EXPECT_NEAR(expected, this->ourDistance(), 1e-12); break;
      case 1: {
        fcl::DistanceResultd found;
        EXPECT_NEAR(expected,
                    pair.distance(this->still(), this->beside_, fcl::DistanceRequestd(), found),
                    1e-12);
        break;
      }
      case 2: EXPECT_NEAR(expected, this->fclDistance(), 1e-12); break;
      case 3: {
        const double d = expected * (below(2) ? 0.9 : 1.1) + 1e-6 * below(2);
        if (std::abs(d - expected) < 1e-9) break;
        EXPECT_EQ(expected < d, proximity.isNearer(this->still(), this->beside_, d));
        break;
      }
      case 4: {
        typename TestFixture::Model copy(this->a_);
        EXPECT_TRUE(this->holdsAll(copy));
        break;
      }
      case 5: EXPECT_TRUE(this->a_.validate()); break;
      case 6: break;
      default: this->expectContacts(); this->expectSelfCollisions();
    }
  }
  EXPECT_GT(waited, 100);
}

/// Whichever query that reads nodes comes first.
TYPED_TEST(OnDemand, TheFirstQueryOfTheNodesIsExact) {
  using Model = typename TestFixture::Model;
  const fcl::Boxd box(0.5, 0.4, 0.6);
  auto cells = std::make_shared<octomap::OcTree>(0.15);
  for (int i = 0; i < 40; ++i)
    cells->updateNode(octomap::point3d(0.07f * float(i % 8), 0.1f * float(i % 5), 0.1f), true);
  const fcl::OcTreed octree(cells);
  const fcl::CollisionRequestd all(100000);
  const std::shared_ptr<Model> shared(&this->a_, [](Model*) {});
  fcl::CollisionObjectd object(shared), other(std::make_shared<fcl::Boxd>(box));
  fcl::DynamicAABBTreeCollisionManagerd manager;
  manager.registerObject(&object);
  manager.registerObject(&other);
  manager.setup();

  int touching = 0;
  for (int step = 0; step < 21; ++step) {
    this->update();
    ASSERT_FALSE(this->holdsAll(this->a_));
    fcl::BVHModel<TypeParam> fresh;  // FCL's alone, built here
    fillModel(TriangleMesh<double>{this->now_, this->sheet_.triangles}, fresh);
    const auto against = [&](const fcl::CollisionGeometryd& geometry, bool ours) {
      fcl::CollisionResultd found, expected;
      if (ours)
        adaptive_bvh::collide<double>(&this->a_, this->still(), &geometry, this->still(), all,
                                      found);
      else
        fcl::collide<double>(&this->a_, this->still(), &geometry, this->still(), all, found);
      fcl::collide<double>(&fresh, this->still(), &geometry, this->still(), all, expected);
      EXPECT_EQ(expected.isCollision(), found.isCollision()) << step;
      if (!ours) {
        EXPECT_EQ(expected.numContacts(), found.numContacts()) << step;
      }
      touching += found.isCollision();
    };
    bool by_boxes = false;  // ours, of shapes and octrees: the nodes still wait
    switch (step % 7) {
      case 0: EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12); break;
      case 1: {
        fcl::CollisionResultd found;
        fcl::collide<double>(&this->a_, this->still(), &this->b_, this->still(), all, found);
        EXPECT_EQ(
            BruteForce<double>(this->a_, this->still(), this->b_, this->still()).contacts().size(),
            found.numContacts());
        break;
      }
      case 2: against(box, false); break;
      case 3:
        against(box, true);
        by_boxes = true;
        break;
      case 4:
        against(octree, true);
        by_boxes = true;
        break;
      case 5: {
        adaptive_bvh::refresh(object, manager);
        bool found = false;
        manager.collide(&found, [](fcl::CollisionObjectd* x, fcl::CollisionObjectd* y, void* hit) {
          fcl::CollisionResultd result;
          *static_cast<bool*>(hit) |= fcl::collide(x, y, fcl::CollisionRequestd(), result) > 0;
          return false;
        });
        fcl::CollisionResultd expected;
        fcl::collide<double>(&fresh, this->still(), &box, this->still(), all, expected);
        EXPECT_EQ(expected.isCollision(), found);
        if (!found) this->a_.updateVolumes();  // their boxes may have been apart
        break;
      }
      default: {
        const fcl::DistanceRequestd request;
        fcl::DistanceResultd found, expected;
        fcl::Transform3d away = this->still();
        away.translation() = Vector3<double>(2, 1, 1);
        adaptive_bvh::distance<double>(&this->a_, this->still(), &box, away, request, found);
        fcl::distance<double>(&fresh, this->still(), &box, away, request, expected);
        EXPECT_NEAR(expected.min_distance, found.min_distance, 1e-6);
        ASSERT_FALSE(this->holdsAll(this->a_));
        away.translation() *= 1e20;  // for which boxes do not serve
        fcl::DistanceResultd far;
        adaptive_bvh::distance<double>(&this->a_, this->still(), &box, away, request, far);
        EXPECT_NEAR(1, far.min_distance / away.translation().norm(), 1e-12);
      }
    }
    ASSERT_EQ(!by_boxes, this->holdsAll(this->a_)) << step;
    if (!by_boxes) this->expectUpToDate(this->a_);
  }
  EXPECT_GT(touching, 3);
}

/// Boxes do not serve bodies that are very far apart; then FCL's nodes do.
TYPED_TEST(OnDemand, FarAwayBodiesHaveTheirVolumesBroughtUpToDate) {
  this->beside_.translation() = Vector3<double>(1e20, 0, 0);
  CoherentDistance<TypeParam> pair(this->a_, this->b_);
  this->update();
  fcl::DistanceResultd result;
  EXPECT_NEAR(1,
              pair.distance(this->still(), this->beside_, fcl::DistanceRequestd(), result) /
                  this->bruteDistance(),
              1e-12);
  this->expectUpToDate(this->a_);
}

/// By the call, by other policies, and by what looks into the tree.
TYPED_TEST(OnDemand, CanBeAskedForAndSwitchedOff) {
  const auto& volume = this->a_.getBV(0).bv;
  this->update();
  ASSERT_FALSE(this->holdsAll(this->a_));
  this->a_.updateVolumes();
  ASSERT_TRUE(this->holdsAll(this->a_));
  const auto first = volume;
  this->a_.updateVolumes();
  EXPECT_EQ(0, std::memcmp(&first, &volume, sizeof(first))) << "nothing waited";

  this->update();
  EXPECT_TRUE(this->a_.validate());
  ASSERT_TRUE(this->holdsAll(this->a_));
  this->update();
  this->a_.originalRadius(3);
  ASSERT_TRUE(this->holdsAll(this->a_));

  this->update();
  this->a_.setRefitPolicy(this->onDemand(true));
  ASSERT_FALSE(this->holdsAll(this->a_));
  this->a_.setRefitPolicy(this->onDemand(false));
  ASSERT_TRUE(this->holdsAll(this->a_));
  for (int step = 0; step < 3; ++step) {
    this->update();
    ASSERT_TRUE(this->holdsAll(this->a_)) << "volumes move with the update again";
    EXPECT_GT(this->a_.lastUpdate().moved, 0);
  }
  this->a_.setRefitPolicy(this->onDemand(true));
  this->update();
  ASSERT_FALSE(this->holdsAll(this->a_));
  EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
  this->expectUpToDate(this->a_);
}

/// A copy has what its source has; then each goes its own way. A move takes what waits along.
TYPED_TEST(OnDemand, CopiesAndMovesAreExact) {
  using Model = typename TestFixture::Model;
  this->update();
  Model copy(this->a_);
  EXPECT_TRUE(copy.refitPolicy().volumes_on_demand);
  this->expectUpToDate(copy);
  const double there = this->bruteDistance();
  this->update();
  fcl::DistanceResultd result;
  EXPECT_NEAR(there,
              fcl::distance<double>(&copy, this->still(), &this->b_, this->beside_,
                                    fcl::DistanceRequestd(), result),
              1e-12);
  ASSERT_FALSE(this->holdsAll(this->a_)) << "it still waits";
  copy.update(this->now_);
  ASSERT_FALSE(this->holdsAll(copy));

  const double here = this->bruteDistance();
  Model moved(std::move(this->a_));
  ASSERT_FALSE(this->holdsAll(moved));
  fcl::DistanceResultd by_boxes, by_nodes;
  EXPECT_NEAR(here,
              adaptive_bvh::distance<double>(&moved, this->still(), &this->b_, this->beside_,
                                             fcl::DistanceRequestd(), by_boxes),
              1e-12);
  EXPECT_NEAR(here,
              fcl::distance<double>(&moved, this->still(), &this->b_, this->beside_,
                                    fcl::DistanceRequestd(), by_nodes),
              1e-12);
  this->expectUpToDate(moved);
  this->a_ = std::move(copy);
  EXPECT_NEAR(here, this->fclDistance(), 1e-12);
  this->expectUpToDate(this->a_);
}

/// Both frames of a two-frame update; then one again.
TYPED_TEST(OnDemand, HoldsBothFrames) {
  for (int step = 0; step < 4; ++step) {
    ASSERT_EQ(fcl::BVH_OK, this->a_.beginUpdateModel());
    this->a_.updateSubModel(this->nextPositions());
    ASSERT_EQ(fcl::BVH_OK, this->a_.endUpdateModel());
    ASSERT_FALSE(this->holdsAll(this->a_));
    EXPECT_NEAR(this->bruteDistance(), this->ourDistance(), 1e-12);
    if (step % 2) continue;
    EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
    ASSERT_NE(nullptr, this->a_.prev_vertices);
    this->expectUpToDate(this->a_);
  }
  this->update();
  ASSERT_EQ(nullptr, this->a_.prev_vertices);
  EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
  this->expectUpToDate(this->a_);
}

/// Also of a single triangle, whose leaf is the root.
TYPED_TEST(OnDemand, HoldsBothFramesOfATriangle) {
  for (int triangles : {1, 2}) {
    TriangleMesh<double> mesh = plate<double>(1, 1);
    mesh.triangles.resize(std::size_t(triangles));
    typename TestFixture::Model model(this->onDemand(true));
    fillModel(mesh, model);
    for (int step = 0; step < 3; ++step) {
      for (auto& p : mesh.vertices) p += Vector3<double>(p[1], 0.3, p[0] * p[0]);
      model.beginUpdateModel();
      model.updateSubModel(mesh.vertices);
      ASSERT_EQ(fcl::BVH_OK, model.endUpdateModel());
      ASSERT_FALSE(this->holdsAll(model));
      model.updateVolumes();
      this->expectUpToDate(model);
    }
  }
}

TYPED_TEST(OnDemand, UpdatesOfSomeVerticesMayWaitToo) {
  std::mt19937 random(9);
  std::uniform_int_distribution<unsigned> vertex(0, unsigned(this->a_.num_vertices) - 1);
  for (int step = 0; step < 12; ++step) {
    const Points& all = this->nextPositions();
    std::vector<unsigned> indices;
    Points positions;
    for (int k = 0; k < 9; ++k) {
      indices.push_back(vertex(random));
      positions.push_back(all[indices.back()]);
    }
    this->a_.update(indices, positions);
    EXPECT_EQ(0, this->a_.lastUpdate().refitted());
    EXPECT_NEAR(this->bruteDistance(), this->ourDistance(), 1e-12);
    ASSERT_FALSE(this->holdsAll(this->a_));
    if (step % 3 != 2) continue;
    EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
    this->expectUpToDate(this->a_);
  }
}

/// What a step left behind that was refused is not what volumes are fitted to.
TYPED_TEST(OnDemand, RefusedUpdatesLeaveNothingBehind) {
  for (const bool some : {false, true}) {
    this->update();
    const double expected = this->bruteDistance();
    Points wrong = this->now_;
    for (auto& p : wrong) p += Vector3<double>(5, 6, 7);
    wrong.back()[1] = std::numeric_limits<double>::quiet_NaN();
    if (some)
      EXPECT_THROW(this->a_.update(std::vector<unsigned>{3, 4}, {wrong[3], wrong.back()}),
                   std::invalid_argument);
    else
      EXPECT_THROW(this->a_.update(wrong), std::invalid_argument);
    EXPECT_NEAR(expected, this->ourDistance(), 1e-12);
    ASSERT_FALSE(this->holdsAll(this->a_));
    EXPECT_NEAR(expected, this->fclDistance(), 1e-12);
    this->expectUpToDate(this->a_);
  }
}

/// A change by FCL's own functions while volumes wait is repaired by whatever comes first.
TYPED_TEST(OnDemand, ForeignChangesMeanwhileAreRepaired) {
  for (int first = 0; first < 6; ++first) {
    this->update();
    ASSERT_FALSE(this->holdsAll(this->a_));
    fcl::BVHModel<TypeParam>& base = this->a_;
    base.beginReplaceModel();
    base.replaceSubModel(this->nextPositions());
    base.endReplaceModel();  // FCL's wrong default
    const double expected = this->bruteDistance();
    switch (first) {
      case 0: EXPECT_NEAR(expected, this->ourDistance(), 1e-12); break;
      case 1: EXPECT_NEAR(expected, this->fclDistance(), 1e-12); break;
      case 2: this->a_.updateVolumes(); break;
      case 3: this->a_.validate(); break;  // which says what it finds
      case 4: this->a_.setRefitPolicy(this->onDemand(false)); break;
      default: this->update(); EXPECT_TRUE(this->a_.lastUpdate().resynchronised);
    }
    EXPECT_NEAR(this->bruteDistance(), this->ourDistance(), 1e-12) << first;
    EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12) << first;
    this->expectUpToDate(this->a_);
    this->a_.setRefitPolicy(this->onDemand(true));
  }
}

/// A body that leaves the range of single precision begins anew, with all its volumes.
TYPED_TEST(OnDemand, BodiesOutOfRangeBeginAnew) {
  this->update();
  for (auto& p : this->now_) p *= 1e12;
  this->a_.update(this->now_);
  EXPECT_TRUE(this->a_.lastUpdate().resynchronised);
  ASSERT_TRUE(this->holdsAll(this->a_));
  this->update();
  EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
}

/// The other propagation has nothing but FCL's nodes, and keeps them up to date.
TYPED_TEST(OnDemand, DisplacementsIgnoreIt) {
  this->update();
  RefitPolicy thesis = RefitPolicy::thesis(adaptive_bvh::FitnessCriterion::ABOrBC);
  thesis.volumes_on_demand = true;
  this->a_.setRefitPolicy(thesis);  // while volumes wait
  this->expectUpToDate(this->a_);
  for (int step = 0; step < 3; ++step) {
    this->update();
    ASSERT_TRUE(this->holdsAll(this->a_));
    EXPECT_GT(this->a_.lastUpdate().inflated, 0);
    EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
  }
  this->a_.setRefitPolicy(this->onDemand(true));
  this->update();
  EXPECT_FALSE(this->holdsAll(this->a_));
}

/// Of models with the default policy, which nobody has asked for FCL's volumes.
template <typename BV>
class Resting : public OnDemand<BV> {
 protected:
  Resting() {
    for (auto* model : {&this->a_, &this->b_}) model->setRefitPolicy(RefitPolicy());
    for (int step = 0; step <= kPatience; ++step) {
      this->ourDistance();
      this->update();
    }
  }
  static constexpr int kPatience = 1;

  bool rests() const { return this->a_.lastUpdate().moved == 0; }
  void expectSound() const {
    EXPECT_TRUE(this->holdsAll(this->a_));
    std::string reason;
    EXPECT_TRUE(this->a_.validate(&reason)) << reason;
  }
  double widest() const {
    double most = 0;
    for (int i = 0; i < this->a_.getNumBVs(); ++i) most += this->a_.getBV(i).bv.width();
    return most;
  }
  /// What code of FCL's does that is handed the models themselves, and does not ask their type.
  std::size_t directCollide() const {
    fcl::CollisionResultd result;
    using Node = std::conditional_t<std::is_same<BV, fcl::RSSd>::value,
                                    fcl::detail::MeshCollisionTraversalNodeRSS<double>,
                                    fcl::detail::MeshCollisionTraversalNodeOBBRSS<double>>;
    Node node;
    EXPECT_TRUE(fcl::detail::initialize(node, this->a_, this->still(), this->b_, this->beside_,
                                        fcl::CollisionRequestd(100000), result));
    fcl::detail::collide(&node);
    return result.numContacts();
  }
};
TYPED_TEST_SUITE(Resting, Volumes);

/// They rest as long as nobody asks for them, and contain their triangles.
TYPED_TEST(Resting, VolumesThatNobodyAsksForContainTheirTriangles) {
  ASSERT_TRUE(this->rests());
  std::size_t contacts = 0;
  for (int step = 0; step < 40; ++step) {
    this->update();
    ASSERT_TRUE(this->rests()) << step;
    EXPECT_EQ(0, this->a_.lastUpdate().inflated + this->a_.lastUpdate().refitted());
    this->expectSound();
    EXPECT_NEAR(this->bruteDistance(), this->ourDistance(), 1e-12);
    const std::size_t touching =
        BruteForce<double>(this->a_, this->still(), this->b_, this->beside_).contacts().size();
    EXPECT_EQ(touching, this->directCollide());
    contacts += touching;
  }
  EXPECT_GT(contacts, 50u);
}

/// The first query of FCL's finds them refitted; while there are such queries they are kept so.
TYPED_TEST(Resting, AQueryOfFclsWakesThem) {
  const double before = this->widest();
  EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
  EXPECT_LT(this->widest(), before);
  EXPECT_EQ(std::size_t(this->a_.getNumBVs()), this->a_.refittedNodes().size());
  this->expectUpToDate(this->a_);
  for (int step = 0; step < 20; ++step) {
    this->update();
    ASSERT_FALSE(this->rests()) << step;
    this->ourDistance();
    EXPECT_NEAR(this->bruteDistance(), this->fclDistance(), 1e-12);
  }
  // Then they rest again, but later: they had to be refitted.
  int steps = 0;
  for (; !this->rests(); ++steps) {
    ASSERT_LE(steps, 4 * this->kPatience);
    this->ourDistance();
    this->update();
  }
  EXPECT_GT(steps, this->kPatience);
}

TYPED_TEST(Resting, OnlyWhereThePolicySaysSo) {
  RefitPolicy policy;
  policy.volumes_rest = false;
  this->a_.setRefitPolicy(policy);
  this->expectUpToDate(this->a_);
  for (int step = 0; step < 10; ++step) {
    this->ourDistance();
    this->update();
    ASSERT_FALSE(this->rests()) << step;
  }
}

/// Updates without any queries between them say nothing about who will ask.
TYPED_TEST(Resting, NotWithoutQueries) {
  typename TestFixture::Model model;
  fillModel(this->sheet_, model);
  for (int step = 0; step < 10; ++step) {
    model.update(this->nextPositions());
    EXPECT_GT(model.lastUpdate().moved, 0);
  }
}

TYPED_TEST(Resting, HoldBothFrames) {
  for (int step = 0; step < 6; ++step) {
    ASSERT_EQ(fcl::BVH_OK, this->a_.beginUpdateModel());
    this->a_.updateSubModel(this->nextPositions());
    ASSERT_EQ(fcl::BVH_OK, this->a_.endUpdateModel());
    ASSERT_TRUE(this->rests());
    ASSERT_NE(nullptr, this->a_.prev_vertices);
    this->expectSound();
  }
}

/// A body on a long way is refitted now and then: volumes that hold all of it would be too large.
TYPED_TEST(Resting, FollowALongWay) {
  double smallest = 1e300, largest = 0;
  for (int step = 0; step < 200; ++step) {
    Points moved;
    for (const auto& p : this->nextPositions())
      moved.push_back(p + Vector3<double>(20. * step, 7. * step, 0));
    this->a_.update(moved);
    ASSERT_TRUE(this->rests());
    this->expectSound();
    const double width = this->a_.getBV(0).bv.width();
    smallest = std::min(smallest, width);
    largest = std::max(largest, width);
  }
  EXPECT_LT(smallest, 10);
  EXPECT_GT(largest, 400);
  EXPECT_LT(largest, 1e4);
}

TYPED_TEST(Resting, CopiesAndMovesAreSound) {
  typename TestFixture::Model moved(std::move(this->a_));
  for (int step = 0; step < 5; ++step) {
    moved.update(this->nextPositions());
    EXPECT_EQ(0, moved.lastUpdate().moved);
    EXPECT_TRUE(this->holdsAll(moved));
  }
  typename TestFixture::Model copy(moved);
  this->expectUpToDate(copy);
  for (int step = 0; step < 5; ++step) {
    copy.update(this->nextPositions());
    EXPECT_TRUE(this->holdsAll(copy));
  }
  EXPECT_TRUE(this->holdsAll(moved));
}

}  // namespace volumes_on_demand_test
}  // namespace adaptive_bvh_test
