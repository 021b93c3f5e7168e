// recording.h: a recording changes nothing in what it reads, and shows the times that the program
// measured, without its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/recording.h"
#include "support/recorded_page.h"

namespace adaptive_bvh_test {
namespace recorded_times_test {

using adaptive_bvh::AdaptiveBVHModeld;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FrameResults;
using adaptive_bvh::Recording;
using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Results that take longer to record than the steps of these tests take.
FrameResults laborious() {
  FrameResults results;
  const std::vector<fcl::Vector3d> points(100000, fcl::Vector3d(100, 0, 0));
  results.addArrows("many", points, points);
  return results;
}

/// Two sheets, one of which waves towards the other; each step is updated and queried.
struct Program {
  explicit Program(int n)
      : sheet(wavingSheet(n, 0)),
        other(wavingSheet(n, 1)),
        distance(sheet, other),
        proximity(sheet, other) {
    below.translation().z() = -0.9;
    for (int k = 0; k < 6; ++k) steps.push_back(wavingSheet(n, 0.2 * k).vertices);
  }

  /// What the update and the query took, milliseconds.
  std::array<double, 2> step(int k) {
    const auto origin = fcl::Transform3d::Identity();
    auto start = Clock::now();
    sheet.update(steps[static_cast<std::size_t>(k) % steps.size()]);
    const double update_ms = millisecondsSince(start);
    start = Clock::now();
    nearest = fcl::DistanceResultd();
    distance.distance(origin, below, fcl::DistanceRequestd(true), nearest);
    is_nearer = proximity.isNearer(origin, below, 0.3);
    return {update_ms, millisecondsSince(start)};
  }

  DeformableMesh sheet, other;
  fcl::Transform3d below = fcl::Transform3d::Identity();
  adaptive_bvh::CoherentDistance distance;
  adaptive_bvh::CoherentProximity proximity;
  std::vector<std::vector<fcl::Vector3d>> steps;
  fcl::DistanceResultd nearest;
  bool is_nearer = false;
};

/// Answers, and the work for them, are the same with and without a recording.
TEST(RecordedTimes, AnswersAndWorkAreThoseWithoutARecording) {
  Program watched(16), alone(16);
  Recording recording;
  recording.add(watched.sheet, fcl::Transform3d::Identity(), "sheet");
  recording.add(watched.other, watched.below, "other");
  for (int k = 0; k < 12; ++k) {
    watched.step(k);
    alone.step(k);
    recording.frame(watched.nearest);
    EXPECT_EQ(watched.nearest.min_distance, alone.nearest.min_distance);
    for (int side = 0; side < 2; ++side)
      EXPECT_EQ(watched.nearest.nearest_points[side], alone.nearest.nearest_points[side]);
    EXPECT_EQ(watched.is_nearer, alone.is_nearer);
    EXPECT_EQ(watched.proximity.searches(), alone.proximity.searches());
    EXPECT_EQ(watched.sheet.lastUpdate().turned, alone.sheet.lastUpdate().turned);
    EXPECT_EQ(watched.sheet.vertices(), alone.sheet.vertices());
  }
  EXPECT_LT(alone.proximity.searches(), 12u) << "else this tests little";
}

/// Of a model also no traversal statistics are recorded, and later updates stay the same.
TEST(RecordedTimes, ChangesNothingInAModel) {
  AdaptiveBVHModeld watched, alone;
  fillModel(wavingSheet(12, 0), watched);
  fillModel(wavingSheet(12, 0), alone);
  Recording recording;
  recording.add(watched, fcl::Transform3d::Identity(), "sheet");
  for (int frame = 1; frame < 5; ++frame) {
    watched.update(wavingSheet(12, 0.2 * frame).vertices);
    alone.update(wavingSheet(12, 0.2 * frame).vertices);
    recording.frame();
    EXPECT_EQ(watched.recordedWork().queries, 0);
    EXPECT_EQ(watched.lastUpdate().refitted(), alone.lastUpdate().refitted());
    for (int node = 0; node < alone.getNumBVs(); ++node)
      ASSERT_EQ(watched.getBV(node).bv.r, alone.getBV(node).bv.r);
  }
}

/// The page has the times that it was given, bit by bit, and none where none were given, however
/// long recording takes; an update's own report stays the same.
TEST(RecordedTimes, ThePageHasTheTimesThatItWasGiven) {
  Program program(8);
  adaptive_bvh::Scene scene;
  scene.add(program.sheet);
  Recording recording;
  recording.follow(scene, [](adaptive_bvh::BodyId) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return std::string("slow");
  });
  std::vector<double> seconds;
  for (int k = 0; k < 4; ++k) {
    program.step(k);
    seconds.push_back(program.sheet.lastUpdate().seconds);
    scene.add(std::make_shared<fcl::Sphered>(1));  // a new name: a slow frame
    FrameResults results = laborious();
    if (k < 3) results.addTimes(1e3 * seconds.back(), 0.125);
    recording.frame(results);
    EXPECT_EQ(program.sheet.lastUpdate().seconds, seconds.back());
  }
  const RecordedPage page(recording);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(page.run["frames"][k]["updateMs"], 1e3 * seconds[k]);
    EXPECT_EQ(page.run["frames"][k]["queryMs"], 0.125);
  }
  for (const char* name : {"updateMs", "queryMs"})
    EXPECT_FALSE(page.run["frames"][3].contains(name)) << "nothing is measured by the recording";
}

/// The times of a program that is recorded are without the work of the recording, which takes
/// several times as long as a step here. (They may be longer than those of the program alone: a
/// frame replaces what the processor's caches hold.)
TEST(RecordedTimes, TheTimesOfAProgramAreWithoutTheRecording) {
  constexpr int kSteps = 30;
  double alone_ms = 1e9, shown_ms = 1e9, frame_ms = 1e9;
  Program alone(60), watched(60);
  for (int k = 0; k < kSteps; ++k) {
    const auto [update_ms, query_ms] = alone.step(k);
    alone_ms = std::min(alone_ms, update_ms + query_ms);
  }
  Recording recording;
  recording.add(watched.sheet, fcl::Transform3d::Identity(), "sheet");
  for (int k = 0; k < kSteps; ++k) {
    const auto [update_ms, query_ms] = watched.step(k);
    const auto start = Clock::now();
    recording.frame(laborious().addTimes(update_ms, query_ms));
    frame_ms = std::min(frame_ms, millisecondsSince(start));
  }
  const RecordedPage page(recording);
  for (const auto& frame : page.run["frames"])
    shown_ms = std::min(shown_ms, frame["updateMs"].get<double>() + frame["queryMs"].get<double>());
  EXPECT_GT(frame_ms, 3 * alone_ms) << "else this tests little";
  EXPECT_LT(shown_ms, alone_ms + frame_ms / 2);
}

}  // namespace recorded_times_test
}  // namespace adaptive_bvh_test
