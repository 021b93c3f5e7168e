// A mesh against an octree: our queries of a DeformableMesh against FCL's of an AdaptiveBVHModel,
// from cells far smaller than triangles to cells far larger. Collisions must name the same pairs,
// or of few contacts some of all, distances must agree. Interleaved in one process; medians.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>

#include <fcl/geometry/octree/octree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#include <octomap/octomap.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "bodies.h"
#include "median.h"
#include "stopwatch.h"

namespace {

using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using scenarios::Point;
using Model = adaptive_bvh::AdaptiveBVHModeld;
using Transform = fcl::Transform3d;

/// The cells of that size that a sphere of radius 1 goes through.
std::shared_ptr<fcl::OcTreed> shell(double cell) {
  auto tree = std::make_shared<octomap::OcTree>(cell);
  const int steps = int(std::ceil(4 / cell));
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j < 2 * steps; ++j) {
      const double polar = M_PI * i / steps, angle = M_PI * j / steps;
      tree->updateNode(
          octomap::point3d(float(std::sin(polar) * std::cos(angle)),
                           float(std::sin(polar) * std::sin(angle)), float(std::cos(polar))),
          true, true);
    }
  tree->updateInnerOccupancy();
  return std::make_shared<fcl::OcTreed>(tree);
}

/// 2 columns^2 triangles around the origin.
scenarios::Mesh sphere(int columns, double radius) {
  scenarios::Mesh mesh = scenarios::grid(columns, columns, 2 * M_PI, M_PI);
  for (Point& p : mesh.vertices) {
    const double angle = p[0], height = p[1];
    p = radius * Point(std::cos(height) * std::cos(angle), std::cos(height) * std::sin(angle),
                       std::sin(height));
  }
  return mesh;
}

/// One mesh, for FCL's queries and for ours.
struct Subject {
  explicit Subject(const scenarios::Mesh& of) : mesh(of) { fillModel(of, model); }
  Model model;
  adaptive_bvh::DeformableMesh mesh;
};

struct Case {
  const char* name;
  scenarios::Mesh mesh;
  Transform pose;
};

Transform shifted(double x) {
  Transform pose = Transform::Identity();
  pose.linear() = fcl::AngleAxisd(0.4, Point(1, 2, 3).normalized()).toRotationMatrix();
  pose.translation() = x * Point(2, -1, 2) / 3;
  return pose;
}

std::vector<Case> cases(const std::vector<int>& columns) {
  std::vector<Case> all;
  all.push_back({"square through", scenarios::grid(1, 1, 2.2, 2.2), shifted(0.3)});
  all.push_back({"square inside", scenarios::grid(1, 1, 1.2, 1.2), shifted(0.03)});
  for (int n : columns) {
    all.push_back({"sphere through", sphere(n, 1), shifted(0.3)});
    all.push_back({"sphere inside", sphere(n, 0.9), shifted(0.03)});
    all.push_back({"sphere beside", sphere(n, 0.5), shifted(1.53)});
  }
  return all;
}

/// One query of one pair, by FCL and by this library.
struct Outcome {
  double fcl, ours;  ///< ms
  std::size_t contacts = 0;
  bool same = false;
};

constexpr std::size_t kAll = 100000000;

using Pairs = std::vector<std::array<long, 2>>;

Pairs pairsOf(const fcl::CollisionResultd& result) {
  Pairs pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    pairs.push_back({result.getContact(i).b1, result.getContact(i).b2});
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Times both `rounds` times, FCL's first and last in turn.
void measure(int rounds, const std::function<void()>& fcls, const std::function<void()>& ours,
             Outcome& outcome) {
  std::vector<double> fcl_times, our_times;
  for (int round = 0; round < rounds; ++round) {
    if (round % 2 == 0) fcl_times.push_back(milliseconds(fcls));
    our_times.push_back(milliseconds(ours));
    if (round % 2 == 1) fcl_times.push_back(milliseconds(fcls));
  }
  outcome.fcl = median(fcl_times);
  outcome.ours = median(our_times);
}

Outcome collide(const Subject& subject, const Transform& pose, const fcl::OcTreed& octree,
                const fcl::CollisionRequestd& request, int rounds) {
  const Transform still = Transform::Identity();
  fcl::CollisionResultd by_fcl, by_us;
  Outcome outcome;
  measure(
      rounds,
      [&] {
        by_fcl.clear();
        fcl::collide(&subject.model, pose, &octree, still, request, by_fcl);
      },
      [&] {
        by_us.clear();
        adaptive_bvh::collide(&subject.mesh, pose, &octree, still, request, by_us);
      },
      outcome);
  outcome.contacts = by_us.numContacts();
  fcl::CollisionResultd by_fcl_all;
  fcl::collide(&subject.model, pose, &octree, still, fcl::CollisionRequestd(kAll), by_fcl_all);
  const Pairs all = pairsOf(by_fcl_all), ours = pairsOf(by_us);
  outcome.same = ours.size() == by_fcl.numContacts() &&
                 std::includes(all.begin(), all.end(), ours.begin(), ours.end());
  return outcome;
}

Outcome distance(const Subject& subject, const Transform& pose, const fcl::OcTreed& octree,
                 bool octree_first, int rounds) {
  const Transform still = Transform::Identity();
  const fcl::DistanceRequestd request;
  double by_fcl = 0, by_us = 0;
  Outcome outcome;
  const auto ask = [&](const fcl::CollisionGeometryd* body, auto&& distance_of) {
    fcl::DistanceResultd result;
    return octree_first ? distance_of(&octree, still, body, pose, result)
                        : distance_of(body, pose, &octree, still, result);
  };
  measure(
      rounds,
      [&] {
        by_fcl = ask(&subject.model, [&](auto* o1, auto& tf1, auto* o2, auto& tf2, auto& result) {
          return fcl::distance(o1, tf1, o2, tf2, request, result);
        });
      },
      [&] {
        by_us = ask(&subject.mesh, [&](auto* o1, auto& tf1, auto* o2, auto& tf2, auto& result) {
          return adaptive_bvh::distance(o1, tf1, o2, tf2, request, result);
        });
      },
      outcome);
  outcome.same = std::abs(std::max(0., by_fcl) - std::max(0., by_us)) < 2e-6;
  return outcome;
}

/// True when the answers agree; a row says what the query found and how long it took.
bool print(const Case& c, double cell, const char* query, const Outcome& outcome) {
  std::printf("| %s | %zu | %g | %s | %zu | %.3f | %.3f | %.2f |%s\n", c.name,
              c.mesh.triangles.size(), cell, query, outcome.contacts, outcome.fcl, outcome.ours,
              outcome.fcl / outcome.ours, outcome.same ? "" : " the answers differ");
  std::fflush(stdout);
  return outcome.same;
}

bool measure(const Case& c, double cell, const fcl::OcTreed& octree, int rounds) {
  const Subject subject(c.mesh);
  bool same = true;
  same &= print(c, cell, "collide",
                collide(subject, c.pose, octree, fcl::CollisionRequestd(kAll), rounds));
  same &= print(c, cell, "contacts",
                collide(subject, c.pose, octree, fcl::CollisionRequestd(kAll, true), rounds));
  same &= print(c, cell, "first contact",
                collide(subject, c.pose, octree, fcl::CollisionRequestd(1), rounds));
  same &= print(c, cell, "distance", distance(subject, c.pose, octree, false, rounds));
  same &= print(c, cell, "distance, octree first", distance(subject, c.pose, octree, true, rounds));
  return same;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A mesh against an octree: FCL's queries and ours, ms.");
  std::vector<int> columns = {4, 8, 16, 32, 64};
  std::vector<double> cells = {0.02, 0.2};
  int rounds = 9;
  app.add_option("--columns", columns, "Spheres of twice this squared triangles; several do");
  app.add_option("--cell", cells, "Sizes of the octree's cells; several do");
  app.add_option("--rounds", rounds, "Medians of so many")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);

  std::printf(
      "| mesh | triangles | cell | query | contacts | FCL | ours | times faster |\n"
      "| --- | ---: | ---: | --- | ---: | ---: | ---: | ---: |\n");
  bool same = true;
  for (double cell : cells) {
    const std::shared_ptr<fcl::OcTreed> octree = shell(cell);
    for (const Case& c : cases(columns)) same &= measure(c, cell, *octree, rounds);
  }
  return same ? 0 : 1;
}
