// Queries, what repeats them, scenes and trackers when memory fails: every allocation once. What is
// kept is what was there before, a result may be used again, and the repeated call answers right.
#include <gtest/gtest.h>

#include <array>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "adaptive_bvh/self_collision.h"
#include "support/closed_bodies.h"
#include "support/failing.h"

namespace adaptive_bvh_test {
namespace failed_query_test {

using adaptive_bvh::DeformableMeshd;
using fcl::Transform3d;

class FailedQuery : public testing::Test {
 protected:
  FailedQuery() : ball_(gridBall<double>(12, 10)), other_(ball_) {
    other_.update(moved(other_.vertices(), {0.3, 0.2, 1.5}));
  }
  static std::vector<Vector3<double>> moved(std::vector<Vector3<double>> points,
                                            const Vector3<double>& by) {
    for (auto& p : points) p += by + Vector3<double>(0.01 * std::sin(9 * p[1]), 0, 0);
    return points;
  }

  /// A few numbers of an answer, in memory that is there.
  struct Numbers {
    template <typename T>
    Numbers& operator<<(T number) {
      numbers[std::size_t(count++)] = double(number);
      return *this;
    }
    std::array<double, 6> numbers = {};
    int count = 0;
  };
  static std::string textOf(const Numbers& numbers) {
    Text text;
    for (const double number : numbers.numbers) text << number;
    return text.text();
  }
  /// Of a query that writes its results into the same memory each time.
  template <typename Query>
  static void failEach(const std::string& what, const Query& query) {
    failEachAllocation(
        what, [] { return Numbers(); },
        [&](Numbers& answer) {
          Numbers numbers;
          query(numbers);
          answer = numbers;
        },
        textOf);
  }

  const Transform3d identity_ = Transform3d::Identity();
  DeformableMeshd ball_, other_;
};

TEST_F(FailedQuery, LeavesResultsThatCanBeUsedAgain) {
  adaptive_bvh::TrianglePairs<double> pairs;
  adaptive_bvh::ProximityRequest<double> request;
  request.distance = 0.2;
  request.enable_distances = request.enable_nearest_points = true;
  for (const int threads : {1, 2}) {
    ball_.setQueryThreads(threads);
    failEach("pairs", [&](Numbers& answer) {
      answer << pairsWithin(ball_, identity_, other_, identity_, request, pairs)
             << pairs.distances.back();
    });
    failEach("collide", [&](Numbers& answer) {
      fcl::CollisionResultd result;
      answer << adaptive_bvh::collide<double>(&ball_, identity_, &other_, identity_,
                                              fcl::CollisionRequestd(10000, true), result);
    });
    failEach("distance", [&](Numbers& answer) {
      fcl::DistanceResultd result;
      answer << adaptive_bvh::distance<double>(&ball_, identity_, &other_, identity_,
                                               fcl::DistanceRequestd(true), result);
    });
    adaptive_bvh::FeaturePairs features;
    failEach("features", [&](Numbers& answer) {
      answer << featurePairsWithin(ball_, identity_, other_, identity_, 0.2, features)
             << features.edge_edge.size();
    });
    adaptive_bvh::FeaturePairDetails<double> details;
    featurePairDetails(ball_, identity_, other_, identity_, features, details);
    adaptive_bvh::FeaturePairDerivatives<double> derivatives;
    failEach("derivatives", [&](Numbers& answer) {
      distanceDerivatives(ball_, identity_, other_, identity_, features, details, derivatives);
      answer << derivatives.edge_edge.second.gradients.back()[2];
    });
    std::vector<double> numbers;
    failEach("clearance", [&](Numbers& answer) {
      clearance(ball_, identity_, other_, identity_, 0.5, numbers);
      answer << numbers.size() << numbers[3];
    });
    std::vector<adaptive_bvh::ClosestPoint<double>> closest;
    failEach("closest", [&](Numbers& answer) {
      closestPoints(ball_, other_.vertices(), closest);
      answer << closest.size() << closest[5].distance;
    });
    adaptive_bvh::VertexContacts<double> first, second;
    failEach("vertices", [&](Numbers& answer) {
      answer << vertexContacts(ball_, identity_, other_, identity_, 0.1, first, second);
    });
    failEach("depth", [&](Numbers& answer) {
      answer << signedDistance(ball_, identity_, other_, identity_, 0.01).lower;
    });
    adaptive_bvh::ContactRegions<double> regions;
    failEach("regions", [&](Numbers& answer) {
      answer << contactRegions(ball_, identity_, other_, identity_, regions);
    });
    adaptive_bvh::FeaturePairs candidates_found;
    const auto moved_on = moved(ball_.vertices(), {0, 0, 0.4});
    const adaptive_bvh::Motion<double> motion(ball_, ball_.vertices(), moved_on);
    const adaptive_bvh::Motion<double> still(other_, other_.vertices(), other_.vertices());
    failEach("candidates", [&](Numbers& answer) {
      candidates(motion, still, 0.1, candidates_found);
      answer << candidates_found.edge_edge.size();
    });
    failEach("impact",
             [&](Numbers& answer) { answer << earliestImpact(motion, still, 0.01).time; });
  }
}

/// What repeats a query step by step, while the meshes go on.
TEST_F(FailedQuery, LeavesWhatIsKeptBetweenSteps) {
  const auto describe = [&](auto& pair) {
    Numbers text;
    fcl::DistanceResultd result;
    text << pair->first.distance(identity_, identity_, fcl::DistanceRequestd(true), result)
         << pair->second.isNearer(identity_, identity_, 0.3)
         << pair->second.isNearer(identity_, identity_, 0.02);
    return text;
  };
  const auto stateOf = [&](auto& pair) { return textOf(describe(pair)); };
  using Pair = std::pair<adaptive_bvh::CoherentDistanced, adaptive_bvh::CoherentProximityd>;
  const DeformableMeshd start = ball_;
  const auto make = [&] {
    ball_ = start;
    auto pair = std::make_unique<Pair>(adaptive_bvh::CoherentDistanced(ball_, other_),
                                       adaptive_bvh::CoherentProximityd(ball_, other_));
    describe(pair);
    ball_ = DeformableMeshd(gridBall<double>(14, 9));  // also another topology
    return pair;
  };
  failEachAllocation("step", make, describe, stateOf, [](const Numbers&) { return false; });
}

TEST_F(FailedQuery, LeavesATracker) {
  adaptive_bvh::ContactRegions<double> before, after;
  contactRegions(ball_, identity_, other_, identity_, before);
  other_.update(moved(other_.vertices(), {0.1, 0, 0}));
  contactRegions(ball_, identity_, other_, identity_, after);
  const auto stateOf = [&](const adaptive_bvh::ContactTracker& tracker) {
    Text text;
    for (const auto id : tracker.ids()) text << id;
    for (const auto& event : tracker.events()) text << int(event.change) << event.id << event.other;
    adaptive_bvh::ContactTracker later = tracker;
    later.track(before);
    for (const auto id : later.ids()) text << id;
    return text.text();
  };
  const auto track = [&](adaptive_bvh::ContactTracker& tracker) { tracker.track(after); };
  EXPECT_GE(failEachAllocation(
                "first", [] { return adaptive_bvh::ContactTracker(); }, track, stateOf),
            3);
  const auto tracked = [&] {
    adaptive_bvh::ContactTracker tracker;
    tracker.track(before);
    return tracker;
  };
  EXPECT_GE(failEachAllocation("second", tracked, track, stateOf), 3);
}

TEST_F(FailedQuery, LeavesAScene) {
  using Scene = adaptive_bvh::Scened;
  const auto sphere = std::make_shared<fcl::Sphered>(0.5);
  const auto make = [&] {
    Scene scene;
    scene.add(ball_);
    scene.add(other_);
    for (int i = 0; i < 6; ++i) {
      Transform3d tf = identity_;
      tf.translation()[0] = 1 + i;
      scene.add(sphere, tf);
    }
    scene.ignore(0, 3);
    scene.update();
    return scene;
  };
  /// Of a scene that may have to be updated first, as before the call.
  const auto stateOf = [&](Scene& scene) {
    Text text;
    text << scene.size() << scene.contains(2);
    scene.update();
    adaptive_bvh::SceneCollisions<double> collisions;
    text << scene.collisions({}, collisions) << scene.distance().distance
         << scene.nearest(0).distance;
    for (const auto& pair : collisions.pairs) text << pair.first << pair.second;
    return text.text();
  };
  const auto failEach = [&](const char* what, const auto& call) {
    return failEachAllocation(what, make, call, stateOf);
  };
  EXPECT_GE(failEach("add", [&](Scene& scene) { scene.add(sphere); }), 1);
  failEach("remove", [&](Scene& scene) { scene.remove(2); });
  EXPECT_GE(failEach("ignore", [&](Scene& scene) { scene.ignore(0, 1); }), 1);
  EXPECT_GE(failEach("chain", [&](Scene& scene) { scene.ignoreNeighbours({0, 1, 2, 4, 5}); }), 1);
  const adaptive_bvh::Scened::Filter filter = [k = std::array<std::size_t, 9>()](auto a, auto b) {
    return a + b + k[0] != 3;
  };
  EXPECT_GE(failEach("filter", [&](Scene& scene) { scene.setFilter(filter); }), 1);
  EXPECT_GE(failEachAllocation(
                "update",
                [&] {
                  Scene scene = make();
                  scene.add(sphere);
                  return scene;
                },
                [](Scene& scene) { scene.update(); }, stateOf),
            5);
  failEach("nearest", [](Scene& scene) { scene.nearest(1); });
  failEach("distance", [](Scene& scene) { scene.distance(); });
}

/// A scene whose update failed does not answer.
TEST_F(FailedQuery, LeavesASceneThatAsksForAnUpdate) {
  adaptive_bvh::Scened scene;
  scene.add(ball_);
  scene.add(other_);
  {
    const FailingAllocation failing(2);
    EXPECT_THROW(scene.update(), std::bad_alloc);
  }
  EXPECT_THROW(scene.isNearer(0.1), std::logic_error);
  scene.update();
  EXPECT_TRUE(scene.isNearer(2));
}

}  // namespace failed_query_test
}  // namespace adaptive_bvh_test
