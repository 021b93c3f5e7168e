// Top-down against bottom-up trees: what they cost to build and what they are worth on the five
// scenarios. Prints the tables of docs/hierarchy.md. Needs a few minutes; see --help.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>

#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "bodies.h"
#include "median.h"
#include "scenarios.h"
#include "stopwatch.h"

namespace {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::HierarchyStrategy;
using adaptive_bvh::RefitPolicy;
using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using Model = adaptive_bvh::AdaptiveBVHModeld;
using Plain = fcl::BVHModel<fcl::RSSd>;
using scenarios::Mesh;
using scenarios::Scenario;

constexpr HierarchyStrategy kStrategies[] = {HierarchyStrategy::TopDown,
                                             HierarchyStrategy::BottomUp};

// ---- building -----------------------------------------------------------------------------------

/// A sheet of about `triangles` triangles with hills.
Mesh hills(int triangles) {
  const int cells = std::max(1, int(std::lround(std::sqrt(triangles / 2.))));
  Mesh mesh = scenarios::grid(cells, cells, 1, 1);
  for (scenarios::Point& p : mesh.vertices) {
    p += scenarios::Point(0.5, 0.5, 0);
    p[2] = 0.1 * std::sin(9 * p[0]) * std::cos(7 * p[1]);
  }
  return mesh;
}

/// The same with three vertices of its own for every triangle.
Mesh cutApart(const Mesh& mesh) {
  Mesh apart;
  for (const fcl::Triangle& t : mesh.triangles) {
    const std::size_t v = apart.vertices.size();
    for (int k = 0; k < 3; ++k) apart.vertices.push_back(mesh.vertices[t[k]]);
    apart.triangles.emplace_back(v, v + 1, v + 2);
  }
  return apart;
}

/// The same with gaps between most triangles.
Mesh soupOf(const Mesh& mesh) {
  Mesh soup = cutApart(mesh);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v)
    soup.vertices[v] *= 1 + 1e-3 * double(v / 3 % 7);
  return soup;
}

void printBuild(const char* name, const Mesh& mesh, int repeats) {
  std::vector<double> fcl, fcl_obbrss, ours[2], deformable;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    Plain plain;
    fcl.push_back(milliseconds([&] { fillModel(mesh, plain); }));
    fcl::BVHModel<fcl::OBBRSSd> plain_obbrss;
    fcl_obbrss.push_back(milliseconds([&] { fillModel(mesh, plain_obbrss); }));
    deformable.push_back(milliseconds([&] { adaptive_bvh::DeformableMesh built(mesh); }));
    for (int k = 0; k < 2; ++k) {
      Model model(kStrategies[k]);
      ours[k].push_back(milliseconds([&] { fillModel(mesh, model); }));
    }
  }
  std::printf(
      "| %-18s | %9zu | %8.1f | %8.1f (%.2f) | %8.1f (%.2f) | %6.2f | %8.1f | %8.1f (%.2f) |\n",
      name, mesh.triangles.size(), median(fcl), median(ours[0]), median(ours[0]) / median(fcl),
      median(ours[1]), median(ours[1]) / median(fcl),
      1e3 * median(ours[1]) / double(mesh.triangles.size()), median(fcl_obbrss), median(deformable),
      median(deformable) / median(fcl_obbrss));
  std::fflush(stdout);
}

void printBuilds(int repeats) {
  std::printf("Building, ms, in brackets against FCL; medians of %d, interleaved\n\n", repeats);
  std::printf(
      "| mesh               | triangles |      FCL |    top-down      |   bottom-up      | us a "
      "triangle | FCL, OBBRSS | DeformableMesh, against that |\n");
  std::printf("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
  for (int n : {1000, 10000, 100000, 500000}) printBuild("hills", hills(n), repeats);
  printBuild("hills, cut apart", cutApart(hills(100000)), repeats);
  printBuild("hills, triangle soup", soupOf(hills(100000)), repeats);
}

// ---- building small models ----------------------------------------------------------------------

/// As FCL makes it, 12 triangles.
Mesh box() {
  Plain model;
  fcl::generateBVHModel(model, fcl::Boxd(1, 1.3, 0.7), fcl::Transform3d::Identity());
  Mesh mesh;
  mesh.vertices.assign(model.vertices, model.vertices + model.num_vertices);
  mesh.triangles.assign(model.tri_indices, model.tri_indices + model.num_tris);
  return mesh;
}

/// The first triangles of a sheet with hills.
Mesh strip(int triangles) {
  Mesh mesh = hills(std::max(2, triangles + triangles / 4));
  if (mesh.triangles.size() > std::size_t(triangles)) mesh.triangles.resize(std::size_t(triangles));
  std::size_t vertices = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) vertices = std::max(vertices, t[k] + 1);
  mesh.vertices.resize(vertices);
  return mesh;
}

/// Microseconds of one build, of `count` models, each used once.
template <typename Model, typename... Arguments>
double buildTime(const adaptive_bvh::TriangleMesh& mesh, int count, Arguments... arguments) {
  std::vector<std::unique_ptr<Model>> models;
  for (int i = 0; i < count; ++i) models.push_back(std::make_unique<Model>(arguments...));
  return 1e3 / count * milliseconds([&] {
           for (auto& model : models) fillModel(mesh, *model);
         });
}

/// Microseconds of one new tree for a model that has one: endReplaceModel(false).
template <typename Model, typename... Arguments>
double rebuildTime(const adaptive_bvh::TriangleMesh& mesh, int count, Arguments... arguments) {
  Model model(arguments...);
  fillModel(mesh, model);
  return 1e3 / count * milliseconds([&] {
           for (int i = 0; i < count; ++i) {
             model.beginReplaceModel();
             model.replaceSubModel(mesh.vertices);
             model.endReplaceModel(false);
           }
         });
}

void printSmallBuild(const char* name, const Mesh& mesh, int repeats) {
  using Ours = adaptive_bvh::AdaptiveBVHModel<fcl::RSSd>;
  using Fcls = fcl::BVHModel<fcl::RSSd>;
  const int count = std::max(1, 500 / int(mesh.triangles.size()));
  std::vector<double> fcl[2], ours[2][2];  // [build or rebuild], [strategy]
  for (int repeat = 0; repeat < 10 * repeats; ++repeat) {
    fcl[0].push_back(buildTime<Fcls>(mesh, count));
    fcl[1].push_back(rebuildTime<Fcls>(mesh, count));
    for (int k = 0; k < 2; ++k) {
      ours[0][k].push_back(buildTime<Ours>(mesh, count, kStrategies[k]));
      ours[1][k].push_back(rebuildTime<Ours>(mesh, count, kStrategies[k]));
    }
  }
  std::printf("| %-9s | double | %5zu |", name, mesh.triangles.size());
  for (int kind = 0; kind < 2; ++kind) {
    std::printf(" %7.1f |", median(fcl[kind]));
    for (const std::vector<double>& times : ours[kind])
      std::printf(" %7.1f (%.2f) |", median(times), median(times) / median(fcl[kind]));
  }
  std::printf("\n");
  std::fflush(stdout);
}

void printSmallBuilds(int repeats) {
  std::printf("\nSmall models, us, in brackets against FCL; medians of %d, interleaved\n\n",
              10 * repeats);
  std::printf("| mesh | scalar | triangles | build: FCL | top-down | bottom-up |");
  std::printf(" rebuild: FCL | top-down | bottom-up |\n");
  std::printf("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
  const auto print = [repeats](const char* name, const Mesh& mesh) {
    printSmallBuild(name, mesh, repeats);
    printSmallBuild(name, mesh, repeats);
  };
  print("box", box());
  print("box, soup", soupOf(box()));
  for (int triangles : {1, 2, 4, 12, 32, 128, 512, 2048}) {
    print("connected", strip(triangles));
    print("soup", soupOf(strip(triangles)));
  }
}

// ---- the scenarios ------------------------------------------------------------------------------

struct Cost {
  double update = 0, query = 0;
  long bv_tests = 0, leaf_tests = 0, refitted = 0;
  void operator+=(const Cost& c) {
    update += c.update;
    query += c.query;
    bv_tests += c.bv_tests;
    leaf_tests += c.leaf_tests;
    refitted += c.refitted;
  }
};

struct Pair {
  Model first, second;

  Pair(const Scenario& scenario, const RefitPolicy& policy, HierarchyStrategy strategy)
      : first(policy, strategy), second(policy, strategy) {
    fillModel(scenario.first.mesh(), first);
    fillModel(scenario.second.mesh(), second);
  }

  Cost frame(const std::vector<scenarios::Point>& p, const std::vector<scenarios::Point>& q) {
    Cost cost;
    const auto identity = fcl::Transform3d::Identity();
    cost.update = milliseconds([&] {
      first.update(p);
      second.update(q);
    });
    cost.refitted = first.lastUpdate().refitted() + second.lastUpdate().refitted();
    fcl::DistanceResultd result;
    cost.query = milliseconds([&] {
      adaptive_bvh::distance(&first, identity, &second, identity, fcl::DistanceRequestd(), result);
    });
    const adaptive_bvh::QueryWork work = first.recordedWork();
    cost.bv_tests = work.bv_tests;
    cost.leaf_tests = work.leaf_tests;
    distance = result.min_distance;
    return cost;
  }

  double distance = 0;
};

/// All frames, both strategies frame by frame in turn. Returns the largest disagreement.
double runScenario(const Scenario& scenario, const RefitPolicy& policy, Cost (&costs)[2]) {
  Pair top_down(scenario, policy, kStrategies[0]), bottom_up(scenario, policy, kStrategies[1]);
  double worst = 0;
  std::vector<scenarios::Point> p, q;
  for (int frame = 1; frame <= scenario.frames(); ++frame) {
    scenario.first.positions(frame, p);
    scenario.second.positions(frame, q);
    costs[0] += top_down.frame(p, q);
    costs[1] += bottom_up.frame(p, q);
    worst = std::max(worst, std::abs(top_down.distance - bottom_up.distance));
  }
  return worst;
}

void printCosts(const std::string& name, const Cost (&costs)[2]) {
  const auto total = [](const Cost& c) { return c.update + c.query; };
  std::printf("| %-26s | %8ld / %8ld | %7ld / %7ld | %7ld / %7ld | %8.1f / %8.1f | %5.2f |\n",
              name.c_str(), costs[0].bv_tests, costs[1].bv_tests, costs[0].leaf_tests,
              costs[1].leaf_tests, costs[0].refitted, costs[1].refitted, total(costs[0]),
              total(costs[1]), total(costs[0]) / total(costs[1]));
  std::fflush(stdout);
}

void printScenarios(int resolution, FitnessCriterion criterion, int repeats) {
  RefitPolicy policy;
  policy.criterion = criterion;
  std::printf("\n%s, triangles x %d; top-down / bottom-up; medians of %d\n\n",
              criterion == FitnessCriterion::RefitAll ? "RefitAll" : "Default criterion",
              resolution * resolution, repeats);
  std::printf("| scenario | BV tests | leaf tests | refits | ms | ratio |\n");
  std::printf("| --- | ---: | ---: | ---: | ---: | ---: |\n");
  scenarios::Options options;
  options.resolution = resolution;
  Cost sum[2];
  double worst = 0;
  for (const Scenario& scenario : scenarios::thesisScenarios(options)) {
    std::vector<double> update[2], query[2];
    Cost costs[2];
    for (int repeat = 0; repeat < repeats; ++repeat) {
      costs[0] = costs[1] = Cost();
      worst = std::max(worst, runScenario(scenario, policy, costs));
      for (int k = 0; k < 2; ++k) {
        update[k].push_back(costs[k].update);
        query[k].push_back(costs[k].query);
      }
    }
    for (int k = 0; k < 2; ++k) {
      costs[k].update = median(update[k]);
      costs[k].query = median(query[k]);
      sum[k] += costs[k];
    }
    printCosts(scenario.name, costs);
  }
  printCosts("all", sum);
  std::printf("\nUpdates %.1f / %.1f ms, queries %.1f / %.1f ms. Largest disagreement %.2g\n",
              sum[0].update, sum[1].update, sum[0].query, sum[1].query, worst);
}

}  // namespace

int main(int argc, char** argv) {
  int repeats = 3;
  std::vector<int> resolutions = {1, 4};
  bool no_builds = false, no_scenarios = false, small_only = false;
  CLI::App app("Top-down against bottom-up trees: building, and the five scenarios of the thesis.");
  app.add_option("--repeats", repeats, "Medians of so many runs")->check(CLI::Range(1, 99));
  app.add_option("--resolution", resolutions, "Triangles times this squared; may be repeated");
  app.add_flag("--no-builds", no_builds, "Leave out the times of building");
  app.add_flag("--no-scenarios", no_scenarios, "Leave out the scenarios");
  app.add_flag("--small-builds", small_only, "The times of building small models only");
  CLI11_PARSE(app, argc, argv);
  if (!no_builds && !small_only) printBuilds(repeats);
  if (!no_builds) printSmallBuilds(repeats);
  if (no_scenarios || small_only) return 0;
  for (int resolution : resolutions)
    for (FitnessCriterion criterion : {RefitPolicy().criterion, FitnessCriterion::RefitAll})
      printScenarios(resolution, criterion, repeats);
}
