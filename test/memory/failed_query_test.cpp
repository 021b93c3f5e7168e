// Queries, what repeats them, scenes and trackers when memory fails: every allocation once. What is
// kept is what was there before, a result may be used again, and the repeated call answers right.
#include <gtest/gtest.h>

#include <array>
#include <numeric>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/motion_clearance.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "adaptive_bvh/self_collision.h"
#include "adaptive_bvh/surface_neighbourhood.h"
#include "adaptive_bvh/trust_region.h"
#include "support/closed_bodies.h"
#include "support/failing.h"

namespace adaptive_bvh_test {
namespace failed_query_test {

using adaptive_bvh::DeformableMesh;
using fcl::Transform3d;

class FailedQuery : public testing::Test {
 protected:
  FailedQuery() : ball_(gridBall(12, 10)), other_(ball_) {
    other_.update(moved(other_.vertices(), {0.3, 0.2, 1.5}));
  }
  static std::vector<fcl::Vector3d> moved(std::vector<fcl::Vector3d> points,
                                          const fcl::Vector3d& by) {
    for (auto& p : points) p += by + fcl::Vector3d(0.01 * std::sin(9 * p[1]), 0, 0);
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
  DeformableMesh ball_, other_;
};

TEST_F(FailedQuery, LeavesResultsThatCanBeUsedAgain) {
  adaptive_bvh::TrianglePairs pairs;
  adaptive_bvh::ProximityRequest request;
  request.distance = 0.2;
  request.enable_distances = request.enable_nearest_points = true;
  for (const int threads : {1, 2}) {
    ball_.setThreads(threads);
    failEach("pairs", [&](Numbers& answer) {
      answer << pairsWithin(ball_, identity_, other_, identity_, request, pairs)
             << pairs.distances.back();
    });
    failEach("collide", [&](Numbers& answer) {
      fcl::CollisionResultd result;
      answer << adaptive_bvh::collide(&ball_, identity_, &other_, identity_,
                                      fcl::CollisionRequestd(10000, true), result);
    });
    failEach("distance", [&](Numbers& answer) {
      fcl::DistanceResultd result;
      answer << adaptive_bvh::distance(&ball_, identity_, &other_, identity_,
                                       fcl::DistanceRequestd(true), result);
    });
    adaptive_bvh::FeaturePairs features;
    failEach("features", [&](Numbers& answer) {
      answer << featurePairsWithin(ball_, identity_, other_, identity_, 0.2, features)
             << features.edge_edge.size();
    });
    adaptive_bvh::FeaturePairDetails details;
    featurePairDetails(ball_, identity_, other_, identity_, features, details);
    adaptive_bvh::FeaturePairDerivatives derivatives;
    failEach("derivatives", [&](Numbers& answer) {
      distanceDerivatives(ball_, identity_, other_, identity_, features, details, derivatives);
      answer << derivatives.edge_edge.second.gradients.back()[2];
    });
    std::vector<double> numbers;
    failEach("clearance", [&](Numbers& answer) {
      vertexDistances(ball_, identity_, other_, identity_, 0.5, numbers);
      answer << numbers.size() << numbers[3];
    });
    std::vector<adaptive_bvh::ClosestPoint> closest;
    failEach("closest", [&](Numbers& answer) {
      closestPoints(ball_, other_.vertices(), closest);
      answer << closest.size() << closest[5].distance;
    });
    adaptive_bvh::VertexContacts first, second;
    failEach("vertices", [&](Numbers& answer) {
      answer << vertexContacts(ball_, identity_, other_, identity_, 0.1, first, second);
    });
    failEach("depth", [&](Numbers& answer) {
      answer << signedDistance(ball_, identity_, other_, identity_, 0.01).lower;
    });
    adaptive_bvh::ContactRegions regions;
    failEach("regions", [&](Numbers& answer) {
      answer << contactRegions(ball_, identity_, other_, identity_, regions);
    });
    adaptive_bvh::FeaturePairs candidates_found;
    const auto moved_on = moved(ball_.vertices(), {0, 0, 0.4});
    const adaptive_bvh::Motion motion(ball_, ball_.vertices(), moved_on);
    const adaptive_bvh::Motion still(other_, other_.vertices(), other_.vertices());
    failEach("candidates", [&](Numbers& answer) {
      candidates(motion, still, 0.1, candidates_found);
      answer << candidates_found.edge_edge.size();
    });
    failEach("impact",
             [&](Numbers& answer) { answer << earliestImpact(motion, still, 0.01).time; });
    failEach("shares", [&](Numbers& answer) {
      std::vector<double> of_first, of_second;
      truncateMotion(motion, still, 0.01, of_first, of_second);
      answer << std::accumulate(of_first.begin(), of_first.end(), 0.);
    });
  }
}

/// Of bodies that move: each query with its own memory.
TEST_F(FailedQuery, RepeatsQueriesOverAMotion) {
  const auto moved_on = moved(ball_.vertices(), {0, 0, 0.4});
  const adaptive_bvh::Motion motion(ball_, ball_.vertices(), moved_on);
  const adaptive_bvh::Motion still(other_, other_.vertices(), other_.vertices());
  const auto sphere = std::make_shared<fcl::Sphered>(0.5);
  Transform3d from = identity_, to = identity_;
  from.translation() = fcl::Vector3d(4, 0, 0);
  to.translation() = fcl::Vector3d(1.6, 1, 0);
  const adaptive_bvh::Motion shape = adaptive_bvh::Motion::rigid(*sphere, from, to);
  failEach("least distance", [&](Numbers& answer) {
    answer << leastDistance(motion, still, 1e-3).upper << leastDistance(motion, shape, 1e-3).upper;
  });
  std::vector<adaptive_bvh::MotionInterval> intervals;
  failEach("intervals", [&](Numbers& answer) {
    adaptive_bvh::intervalsBelow(motion, still, 0.2, 1e-2, intervals);
    answer << intervals.size() << intervals[0].begin;
  });
  const auto neighbours = adaptive_bvh::SurfaceNeighbourhood::byRings(ball_, 3);
  adaptive_bvh::Ignored ignored;
  ignored.surface = &neighbours;
  failEach("self", [&](Numbers& answer) {
    answer << adaptive_bvh::selfLeastDistance(motion, ignored, 1e-2).upper;
  });
  failEach("times", [&](Numbers& answer) {
    adaptive_bvh::FeaturePairs pairs;
    adaptive_bvh::ImpactTimes times;
    answer << earliestImpact(motion, still, 0.01, pairs).time;
    timesOfImpact(motion, still, pairs, 0.01, times);
    answer << times.edge_edge.size() << selfEarliestImpact(motion, 0.01).time;
  });
  failEach("safe", [&](Numbers& answer) {
    std::vector<double> of_first, of_second;
    safeDisplacements(motion, still, 0.01, of_first, of_second);
    answer << std::accumulate(of_first.begin(), of_first.end(), 0.);
  });
}

TEST_F(FailedQuery, RepeatsQueriesOfAMovingScene) {
  adaptive_bvh::Scene scene;
  const auto sphere = std::make_shared<fcl::Sphered>(0.5);
  const auto plane = std::make_shared<fcl::Halfspaced>(fcl::Vector3d(0, 0, 1), -1.5);
  const auto to = moved(ball_.vertices(), {0, 0, 0.4});
  ball_.updateTwoFrames(to);
  scene.add(ball_);
  scene.add(other_);
  scene.add(plane);
  for (const double shift : {1., 0.}) {
    for (unsigned i = 0; i < 3; ++i) {
      Transform3d tf = identity_;
      tf.translation()[0] = 2 + i + shift;
      shift > 0 ? (void)scene.add(sphere, tf) : scene.setTransform(3 + i, tf);
    }
    scene.update();
    if (shift > 0) scene.beginStep();
  }
  const auto& still = scene;
  failEach("nearest", [&](Numbers& answer) {
    answer << still.leastDistance(0, 1e-3).clearance.upper
           << still.leastDistance(3, 1e-3).clearance.upper;
  });
  std::vector<adaptive_bvh::SceneClearance> several;
  failEach("several", [&](Numbers& answer) {
    still.leastDistances(0, 3, 1e-3, adaptive_bvh::FramePath::Screw, several);
    answer << several.size() << several[1].clearance.upper;
  });
  adaptive_bvh::SceneIntervals intervals;
  failEach("intervals", [&](Numbers& answer) {
    answer << still.intervalsBelow(0.2, 1e-2, intervals) << intervals.found[0].begin;
  });
  failEach("impact", [&](Numbers& answer) {
    const auto found = still.earliestImpact(0.01);
    answer << found.impact.time << found.bodies.second;
  });
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
  using Pair = std::pair<adaptive_bvh::CoherentDistance, adaptive_bvh::CoherentProximity>;
  const DeformableMesh start = ball_;
  const auto make = [&] {
    ball_ = start;
    auto pair = std::make_unique<Pair>(adaptive_bvh::CoherentDistance(ball_, other_),
                                       adaptive_bvh::CoherentProximity(ball_, other_));
    describe(pair);
    ball_ = DeformableMesh(gridBall(14, 9));  // also another topology
    return pair;
  };
  failEachAllocation("step", make, describe, stateOf, [](const Numbers&) { return false; });
}

/// A trust region that searches, and one that is in the middle of a step.
TEST_F(FailedQuery, LeavesATrustRegion) {
  const auto start = ball_.vertices(), wanted = moved(start, {0, 0, 0.2});
  const auto make = [&] {
    adaptive_bvh::TrustRegionRequest request;
    request.radius = 0.05;
    auto region = std::make_unique<adaptive_bvh::TrustRegion>(ball_, request);
    region->addObstacle(other_);
    region->begin(start);
    auto accepted = start;
    EXPECT_GT(region->truncate(wanted, accepted).held_by_radius, start.size() / 2);
    return region;
  };
  const auto stateOf = [&](auto& region) {
    Text text;
    text << region->numPairs();
    for (const auto& x : region->accepted()) text << x[2];
    return text.text();
  };
  const auto iterate = [&](auto& region) {
    std::vector<fcl::Vector3d> accepted;
    region->truncate(wanted, accepted);
  };
  EXPECT_GE(failEachAllocation("iterate", make, iterate, stateOf), 1);
  EXPECT_GE(failEachAllocation(
                "begin", make, [&](auto& region) { region->begin(wanted); }, stateOf),
            1);
}

TEST_F(FailedQuery, LeavesATracker) {
  adaptive_bvh::ContactRegions before, after;
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
  using Scene = adaptive_bvh::Scene;
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
    adaptive_bvh::SceneCollisions collisions;
    text << scene.collide({}, collisions) << scene.distance().distance << scene.nearest(0).distance;
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
  const adaptive_bvh::Scene::Filter filter = [k = std::array<std::size_t, 9>()](auto a, auto b) {
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
  adaptive_bvh::Scene scene;
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
