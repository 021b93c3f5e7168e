// Distances where hardly anything prunes: parallel plates, slivers, spheres one inside the other, a
// hose in its sleeve, a bar that spins by its vertices, a soup whose triangles jump. Queries alone,
// in turns in one process, medians; FCL's on swept spheres that it has just refitted. All distances
// must be those in quadruple precision; of large meshes, those of the first three frames.
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include <fcl/narrowphase/distance.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/query.h"
#include "bodies.h"
#include "distance_judge.h"
#include "fcl_support.h"
#include "median.h"
#include "stopwatch.h"

namespace {

using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using scenarios::Mesh;
using scenarios::Point;
using Positions = std::vector<Point>;

/// Two bodies, and the positions of each in every frame.
struct Cliff {
  const char* name;
  Mesh first, second;
  std::function<Positions(const Mesh&, int)> move_first, move_second;
};

Positions still(const Mesh& mesh, int) { return mesh.vertices; }

Positions turned(const Mesh& mesh, double angle, const Point& axis) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  Positions positions = mesh.vertices;
  for (Point& p : positions) p = turn * p;
  return positions;
}

Mesh lifted(Mesh mesh, double height) {
  for (Point& p : mesh.vertices) p[2] += height;
  return mesh;
}

/// 4,900 triangles in a square of side 1.
Mesh plate(double height) { return lifted(scenarios::grid(50, 49, 1, 1), height); }

Mesh sphere(double radius, const Point& at, int around = 70, int rows = 35) {
  Mesh mesh = scenarios::grid(around, rows, 2 * M_PI, 0.98 * M_PI);
  for (Point& p : mesh.vertices) {
    const double angle = p[0], height = p[1];
    p = radius * Point(std::cos(height) * std::cos(angle), std::cos(height) * std::sin(angle),
                       std::sin(height)) +
        at;
  }
  return mesh;
}

/// A square of triangles as long as itself, and 1,500 times as long as wide.
Mesh slivers(double height, bool crossed) {
  Mesh mesh = lifted(scenarios::grid(1, 1500, 1, 1), height);
  if (crossed)
    for (Point& p : mesh.vertices) std::swap(p[0], p[1]);
  return mesh;
}

/// 4,900 loose triangles.
Mesh soup() {
  Mesh mesh;
  for (unsigned t = 0; t < 4900; ++t) {
    for (unsigned k = 0; k < 3; ++k) mesh.vertices.push_back(Point::Zero());
    mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
  }
  return mesh;
}
/// Each somewhere else in every frame.
Positions jumped(const Mesh& mesh, int frame, double height) {
  std::mt19937 random(static_cast<unsigned>(frame) + (height > 0 ? 1000u : 0u));
  std::uniform_real_distribution<double> any(-0.5, 0.5);
  const auto point = [&]() -> Point { return {any(random), any(random), any(random)}; };
  Positions positions(mesh.vertices.size());
  for (std::size_t t = 0; t < positions.size() / 3; ++t) {
    const Point at = point() + Point(0, 0, height);
    for (std::size_t k = 0; k < 3; ++k) positions[3 * t + k] = at + 0.06 * point();
  }
  return positions;
}

std::vector<Cliff> cliffs() {
  const auto slide = [](const Mesh& mesh, int frame) -> Positions {
    Positions positions = mesh.vertices;
    for (Point& p : positions) p += frame * Point(0.0031, 0.0017, 0);
    return positions;
  };
  const auto turn = [](const Mesh& mesh, int frame) -> Positions {
    return turned(mesh, 0.05 * frame, Point::UnitZ());
  };
  const auto breathe = [](const Mesh& mesh, int frame) -> Positions {
    Positions positions = mesh.vertices;
    for (Point& p : positions) p *= 1 + 0.003 * std::sin(0.7 * frame + 4 * p[0]);
    return positions;
  };
  const auto spin = [](const Mesh& mesh, int frame) -> Positions {
    return turned(mesh, 0.4 * frame, Point(1, 2, 3));
  };
  Mesh bar = scenarios::tube(20, 122, 0.05, 2);
  for (Point& p : bar.vertices) p[2] += 1;
  return {
      {"plates, still", plate(0), plate(0.1), still, still},
      {"plates, sliding", plate(0), plate(0.1), still, slide},
      {"plates, turning", plate(0), plate(0.1), still, turn},
      {"slivers crossed", slivers(0, false), slivers(0.1, true), still, slide},
      {"slivers parallel", slivers(0, false), slivers(0.1, false), still, slide},
      {"touching spheres", sphere(1, Point::Zero()), sphere(1, Point(0, 0, 2)), breathe, still},
      {"concentric spheres, 1 and 1.1", sphere(1, Point::Zero()), sphere(1.1, Point::Zero()),
       breathe, still},
      {"large concentric spheres, 0.5 and 1", sphere(0.5, Point::Zero(), 158, 80),
       sphere(1, Point::Zero(), 158, 80), breathe, still},
      {"a hose in its sleeve", scenarios::tube(160, 80, 0.5, 2), scenarios::tube(160, 80, 0.6, 2),
       still, still},
      {"a bar that spins askew", bar, plate(-1.2), spin, still},
      {"a soup that jumps", soup(), soup(),
       [](const Mesh& mesh, int frame) { return jumped(mesh, frame, 0); },
       [](const Mesh& mesh, int frame) { return jumped(mesh, frame, 1.02); }},
  };
}

/// In general orientation.
Positions posed(Positions positions) {
  const Eigen::Matrix3d pose = Eigen::AngleAxisd(0.7, Point(1, -2, 0.6).normalized()).matrix();
  for (Point& p : positions) p = pose * p;
  return positions;
}

class FclPair {
 public:
  explicit FclPair(const Cliff& cliff) {
    adaptive_bvh::fillModel(cliff.first, first_);
    adaptive_bvh::fillModel(cliff.second, second_);
  }
  void update(const Positions& first, const Positions& second) {
    adaptive_bvh_bench::refitTopDown(first_, first);
    adaptive_bvh_bench::refitTopDown(second_, second);
  }
  double distance() const {
    fcl::DistanceResultd result;
    return fcl::distance(&first_, origin_, &second_, origin_, fcl::DistanceRequestd(), result);
  }

 private:
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  fcl::BVHModel<fcl::RSSd> first_, second_;
};

class MeshPair {
 public:
  explicit MeshPair(const Cliff& cliff) : first_(cliff.first), second_(cliff.second) {}
  void update(const Positions& first, const Positions& second) {
    first_.update(first);
    second_.update(second);
  }
  double distance(bool coherently) {
    const fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    return coherently
               ? coherent_.distance(origin_, origin_, request, result)
               : adaptive_bvh::distance(&first_, origin_, &second_, origin_, request, result);
  }

 private:
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  adaptive_bvh::DeformableMesh first_, second_;
  adaptive_bvh::CoherentDistance coherent_{first_, second_};
};

struct Row {
  double fcl, mesh, coherent;  ///< ms a frame
  double worst_error = 0;      ///< of a distance
};

Row measure(const Cliff& cliff, int frames, int repeats) {
  std::vector<double> of_fcl, of_mesh, of_coherent;
  Row row{};
  for (int repeat = 0; repeat < repeats; ++repeat) {
    FclPair fcl(cliff);
    MeshPair mesh(cliff), coherent(cliff);
    double sums[3] = {0, 0, 0};
    for (int frame = 0; frame < frames; ++frame) {
      const Positions first = posed(cliff.move_first(cliff.first, frame)),
                      second = posed(cliff.move_second(cliff.second, frame));
      fcl.update(first, second);
      mesh.update(first, second);
      coherent.update(first, second);
      const std::function<double()> queries[3] = {[&] { return fcl.distance(); },
                                                  [&] { return mesh.distance(false); },
                                                  [&] { return coherent.distance(true); }};
      double distances[3];
      for (int i = 0; i < 3; ++i) {
        const int k = (i + frame + repeat) % 3;
        const double time = milliseconds([&] { distances[k] = queries[k](); });
        if (frame >= 2) sums[k] += time;  // the first find where things are
      }
      const bool is_large = cliff.first.triangles.size() > 10000;
      if (repeat > 0 || (is_large && frame > 2)) continue;
      const double exact = adaptive_bvh_bench::exactDistance({first, cliff.first.triangles},
                                                             {second, cliff.second.triangles});
      for (int k : {1, 2})
        row.worst_error = std::max(row.worst_error, std::abs(distances[k] - exact));
    }
    of_fcl.push_back(sums[0] / (frames - 2));
    of_mesh.push_back(sums[1] / (frames - 2));
    of_coherent.push_back(sums[2] / (frames - 2));
  }
  row.fcl = median(of_fcl);
  row.mesh = median(of_mesh);
  row.coherent = median(of_coherent);
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Distances where hardly anything prunes: milliseconds of a query alone.");
  int repeats = 3, frames = 24;
  std::vector<std::string> names;
  app.add_option("--repeats", repeats, "Tables show medians")->check(CLI::Range(1, 1000));
  app.add_option("--frames", frames, "Of each")->check(CLI::Range(3, 10000));
  app.add_option("--scenario", names, "Only those whose name holds this");
  CLI11_PARSE(app, argc, argv);

  std::printf(
      "| | FCL | `adaptive_bvh::distance` | `CoherentDistance` | FCL takes | coherent takes | "
      "worst error |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n");
  bool right = true;
  for (const Cliff& cliff : cliffs()) {
    const auto is_named = [&](const std::string& name) {
      return std::string(cliff.name).find(name) != std::string::npos;
    };
    if (!names.empty() && std::none_of(names.begin(), names.end(), is_named)) continue;
    const Row row = measure(cliff, frames, repeats);
    std::printf("| %s | %.3g | %.3g | %.3g | %.2f | %.2f | %.0e |\n", cliff.name, row.fcl, row.mesh,
                row.coherent, row.fcl / row.mesh, row.coherent / row.mesh, row.worst_error);
    std::fflush(stdout);
    right = right && row.worst_error < 1e-9;
  }
  return right ? 0 : 1;
}
