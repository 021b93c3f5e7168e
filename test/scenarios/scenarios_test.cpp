// The scenarios agree with the thesis and with their descriptions.
#include "scenarios.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "contact_bodies.h"
#include "poses.h"

namespace adaptive_bvh_test {
namespace scenarios_test {

using scenarios::Body;
using scenarios::Mesh;
using scenarios::Options;
using scenarios::Point;
using scenarios::Scenario;

std::vector<Scenario> all(const Options& options = {}) {
  std::vector<Scenario> list = scenarios::thesisScenarios(options);
  for (const Scenario& scenario : scenarios::furtherScenarios(options)) list.push_back(scenario);
  return list;
}

void expectSize(std::size_t vertices, std::size_t triangles, int frames, const Body& body) {
  EXPECT_EQ(vertices, body.vertices()) << body.name();
  EXPECT_EQ(triangles, body.triangles().size()) << body.name();
  EXPECT_EQ(frames, body.frames()) << body.name();
}

TEST(Scenarios, HaveTheSizesOfThesisTable1) {
  expectSize(100, 162, 62, scenarios::plate());
  expectSize(100, 162, 218, scenarios::twistingPlate());
  expectSize(100, 180, 127, scenarios::cable());
  expectSize(385, 710, 20, scenarios::helmet());
  expectSize(100, 162, 29, scenarios::foldingSheet());
  const std::vector<Scenario> five = scenarios::thesisScenarios();
  ASSERT_EQ(5u, five.size());
  const int frames[] = {218, 127, 29, 127, 62};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(frames[i], five[i].frames()) << five[i].name;
}

TEST(Scenarios, GrowWithTheSquareOfTheResolution) {
  for (int s : {2, 3}) {
    const std::vector<Scenario> coarse = all(), fine = all({s, false});
    for (std::size_t i = 0; i < coarse.size(); ++i)
      EXPECT_EQ(coarse[i].triangles() * std::size_t(s * s), fine[i].triangles()) << fine[i].name;
  }
}

/// The point of `points` nearest to p.
double nearest(const Point& p, const std::vector<Point>& points) {
  double least = 1e9;
  for (const Point& q : points) least = std::min(least, (p - q).norm());
  return least;
}

// The vertices of the coarse body are vertices of the finer one, in every frame.
TEST(Scenarios, MoveAlikeAtEveryResolution) {
  const std::vector<Scenario> coarse = scenarios::thesisScenarios(),
                              fine = scenarios::thesisScenarios({2, false});
  for (std::size_t i = 0; i < coarse.size(); ++i)
    for (int frame : {0, 7, 19, 60, 500})
      for (auto body : {&Scenario::first, &Scenario::second}) {
        const std::vector<Point> points = (fine[i].*body).positions(frame);
        for (const Point& p : (coarse[i].*body).positions(frame))
          EXPECT_LT(nearest(p, points), 1e-9);
      }
}

TEST(Scenarios, TurnAsAWhole) {
  const std::vector<Scenario> aligned = all({1, true}), general = all();
  for (std::size_t i = 0; i < aligned.size(); ++i) {
    const auto p = aligned[i].first.positions(9), q = aligned[i].second.positions(9);
    const auto tp = general[i].first.positions(9), tq = general[i].second.positions(9);
    EXPECT_NEAR((p[5] - q[11]).norm(), (tp[5] - tq[11]).norm(), 1e-12);
    EXPECT_GT((p[5] - tp[5]).norm(), 0.01);
  }
}

TEST(Scenarios, StayAsTheyAreAfterTheirLastFrame) {
  const Body helmet = scenarios::helmet();
  EXPECT_EQ(helmet.positions(20), helmet.positions(21));
  EXPECT_NE(helmet.positions(10), helmet.positions(11));
}

/// Distances in all frames.
std::vector<double> distances(const Scenario& scenario) {
  adaptive_bvh::DeformableMesh a(scenario.first.mesh()), b(scenario.second.mesh());
  const auto origin = fcl::Transform3d::Identity();
  std::vector<double> found;
  for (int frame = 1; frame <= scenario.frames(); ++frame) {
    a.update(scenario.first.positions(frame));
    b.update(scenario.second.positions(frame));
    fcl::DistanceResultd result;
    found.push_back(
        adaptive_bvh::distance(&a, origin, &b, origin, fcl::DistanceRequestd(), result));
  }
  return found;
}

// Near each other all the time, with gaps nearly always: what the queries have to do matters.
TEST(Scenarios, ComeNearAndRarelyTouch) {
  int touching = 0, frames = 0;
  for (const Scenario& scenario : all()) {
    const std::vector<double> found = distances(scenario);
    EXPECT_LT(*std::min_element(found.begin(), found.end()), 0.13) << scenario.name;
    EXPECT_LT(*std::max_element(found.begin(), found.end()), 2.3) << scenario.name;
    const auto touches = std::count_if(found.begin(), found.end(), [](double d) { return d <= 0; });
    EXPECT_LE(touches, scenario.frames() / 7) << scenario.name;
    touching += int(touches);
    frames += scenario.frames();
  }
  EXPECT_GT(touching, 0);
  EXPECT_LT(touching, frames / 20);
}

TEST(Scenarios, MoveSmoothly) {
  for (const Scenario& scenario : all())
    for (const Body* body : {&scenario.first, &scenario.second}) {
      const scenarios::MotionSize size = scenarios::measureMotion(*body);
      EXPECT_LT(size.largest_in_diagonals, 0.12) << scenario.name << ": " << body->name();
      EXPECT_LE(size.mean_in_edges, size.largest_in_edges);
    }
}

TEST(Scenarios, AnElementPokesAnHundredth) {
  const Body sheet = scenarios::furtherScenarios()[0].first;
  const std::vector<Point> before = sheet.positions(9), after = sheet.positions(10);
  std::size_t moved = 0;
  for (std::size_t v = 0; v < before.size(); ++v) moved += before[v] != after[v];
  EXPECT_NEAR(0.01, double(moved) / double(before.size()), 0.003);
}

TEST(Scenarios, ATumbleHasNoStrain) {
  const Body helmet = scenarios::furtherScenarios()[3].first;
  const std::vector<Point> before = helmet.positions(0), after = helmet.positions(23);
  for (const fcl::Triangle& t : helmet.triangles())
    EXPECT_NEAR((before[t[0]] - before[t[1]]).norm(), (after[t[0]] - after[t[1]]).norm(), 1e-12);
}

TEST(Scenarios, InterpolateThereAndBack) {
  const Mesh mesh = scenarios::helmet().mesh();
  std::vector<Point> to = mesh.vertices;
  for (Point& p : to) p *= 1.5;
  const Scenario scenario = scenarios::interpolated("helmet", mesh, to, 10);
  EXPECT_NEAR(0, (scenario.first.positions(5)[7] - to[7]).norm(), 1e-12);
  EXPECT_NEAR(0, (scenario.first.positions(10)[7] - mesh.vertices[7]).norm(), 1e-12);
  EXPECT_GT(distances(scenario)[9], 0);
  to.pop_back();
  EXPECT_THROW(scenarios::interpolated("helmet", mesh, to, 10), std::invalid_argument);
}

/// A helmet, a plate far above it and another far below, in one mesh; every triangle has its own
/// vertices, so that only their positions connect them.
Mesh threePartSoup() {
  Mesh soup;
  for (const Body& body :
       {scenarios::plate().placed(scenarios::Pose(Eigen::Translation3d(0, 0, 3))),
        scenarios::helmet(),
        scenarios::plate().placed(scenarios::Pose(Eigen::Translation3d(0, 0, -3)))}) {
    const Mesh mesh = body.mesh();
    for (const fcl::Triangle& t : mesh.triangles) {
      const std::size_t v = soup.vertices.size();
      for (int k = 0; k < 3; ++k) soup.vertices.push_back(mesh.vertices[t[k]]);
      soup.triangles.emplace_back(v, v + 1, v + 2);
    }
  }
  return soup;
}

TEST(Scenarios, SplitAMeshIntoItsLargestPartAndTheOthers) {
  const Mesh soup = threePartSoup();
  std::vector<Point> to = soup.vertices;
  for (std::size_t v = 0; v < to.size(); ++v) to[v] += Point(0, 0, double(v));
  const Scenario scenario = scenarios::interpolatedParts("three", soup, to, 10);
  EXPECT_EQ(scenarios::helmet().triangles().size(), scenario.first.triangles().size());
  EXPECT_EQ(2 * scenarios::plate().triangles().size(), scenario.second.triangles().size());
  EXPECT_EQ(soup.vertices.size(), scenario.first.vertices() + scenario.second.vertices());

  // Each goes its own way, and back.
  const std::size_t before = 3 * scenarios::plate().triangles().size();  // the plate's come first
  EXPECT_NEAR(0, (scenario.first.positions(5)[7] - to[before + 7]).norm(), 1e-9);
  EXPECT_NEAR(0, (scenario.second.positions(5).back() - to.back()).norm(), 1e-9);
  EXPECT_NEAR(0, (scenario.second.positions(10)[7] - soup.vertices[7]).norm(), 1e-9);

  const Mesh one = scenarios::helmet().mesh();
  EXPECT_THROW(scenarios::interpolatedParts("one", one, one.vertices, 10), std::invalid_argument);
  to.pop_back();
  EXPECT_THROW(scenarios::interpolatedParts("three", soup, to, 10), std::invalid_argument);
}

// Apart by less than a millionth, then into each other; the vertices that face each other say so.
TEST(Scenarios, PressRodsTogether) {
  for (const Options& options : {Options{1, false}, Options{2, true}}) {
    const Scenario rods = scenarios::pressedRodsPair(options);
    EXPECT_EQ(std::size_t(5120 * options.resolution * options.resolution), rods.triangles());
    const std::vector<double> found = distances(rods);
    ASSERT_EQ(21u, found.size());
    for (int i = 0; i < 21; ++i) {
      const double gap = std::max(0., 1e-6 * (1 - 2 * (i + 1) / 21.));
      EXPECT_LE(found[i], gap + 1e-15) << "frame " << i + 1;
      EXPECT_GE(found[i], 0.5 * gap) << "frame " << i + 1;  // at least by cosines of their slopes
    }
  }
}

/// Pairs of triangles that intersect.
std::size_t selfContacts(const Body& body, int frame) {
  adaptive_bvh::DeformableMesh mesh(body.mesh());
  mesh.update(body.positions(frame));
  fcl::CollisionResultd result;
  return selfCollide(mesh, fcl::CollisionRequestd(1000000), result);
}

TEST(Scenarios, TouchThemselves) {
  for (int resolution : {1, 2})
    for (const Body& body :
         {scenarios::coilingCable(resolution), scenarios::crumpledSheet(resolution),
          scenarios::pressedRods(resolution)}) {
      EXPECT_EQ(0u, selfContacts(body, 1)) << body.name();
      EXPECT_GT(selfContacts(body, body.frames()), 0u) << body.name();
    }
}

TEST(Scenarios, WithAStrideLeaveOutFrames) {
  for (const Scenario& scenario : all()) {
    const Scenario every_fourth = scenarios::withStride(scenario, 4);
    EXPECT_EQ(scenario.frames() / 4, every_fourth.frames()) << scenario.name;
    for (int frame : {0, 1, 5, 30, 100}) {
      EXPECT_EQ(scenario.first.positions(4 * frame), every_fourth.first.positions(frame));
      EXPECT_EQ(scenario.second.positions(4 * frame), every_fourth.second.positions(frame));
    }
  }
  EXPECT_EQ(1, scenarios::withStride(all().front(), 1000).frames());
}

}  // namespace scenarios_test
}  // namespace adaptive_bvh_test
