// Steps of solvers on the frames of simulations (Wang et al. 2022): how much of a motion each way
// of truncating it keeps, and what it costs; ten iterations within a trust region, and ten searches
// for the largest safe step. Calls of both sides in turns in one process, medians.
#include <cstdio>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/trust_region.h"
#include "median.h"
#include "stopwatch.h"
#include "support/step_data.h"

namespace {

using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using Mesh = adaptive_bvh::DeformableMesh;
using Motion = adaptive_bvh::Motion;
using Positions = std::vector<Eigen::Vector3d>;
using TriangleMesh = adaptive_bvh::TriangleMesh;

/// A part of the way from each position to another one.
Positions between(const Positions& from, const Positions& to, double part) {
  Positions at(from.size());
  for (std::size_t v = 0; v < from.size(); ++v) at[v] = from[v] + part * (to[v] - from[v]);
  return at;
}

/// A part of the step between two frames.
struct Step {
  std::string title;
  TriangleMesh start;
  Positions end;

  Step(const std::string& name, const TriangleMesh& from, const TriangleMesh& to, double part)
      : title(name), start(from), end(between(from.vertices, to.vertices, part)) {}
};

double meanEdge(const Mesh& mesh, const Positions& positions) {
  double sum = 0;
  for (const fcl::Triangle& t : mesh.triangles())
    for (int k = 0; k < 3; ++k) sum += (positions[t[k]] - positions[t[(k + 1) % 3]]).norm();
  return sum / (3 * double(mesh.triangles().size()));
}

/// What is kept of the motion, from lengths of vertices.
struct Motions {
  std::vector<double> lengths;
  double sum = 0, largest = 0;

  Motions(const Positions& from, const Positions& to) {
    for (std::size_t v = 0; v < from.size(); ++v) {
      lengths.push_back((to[v] - from[v]).norm());
      sum += lengths.back();
      largest = std::max(largest, lengths.back());
    }
  }
  /// `kept(v)`: the length that a vertex goes.
  template <typename Kept>
  double share(const Kept& kept) const {
    double some = 0;
    for (std::size_t v = 0; v < lengths.size(); ++v) some += kept(v);
    return some / sum;
  }
};

void compareTruncations(const Step& step, int repeats) {
  const Positions& start = step.start.vertices;
  const Mesh mesh(step.start);
  const Motion motion(mesh, start, step.end);
  const Motions wanted(start, step.end);
  std::vector<double> safe, shares, safe_times, plane_times, step_times;
  double largest = 0;
  for (int i = 0; i < repeats; ++i) {
    step_times.push_back(milliseconds([&] { largest = selfLargestSafeStep(motion); }));
    safe_times.push_back(milliseconds([&] { selfSafeDisplacements(motion, 0, safe); }));
    plane_times.push_back(milliseconds([&] { selfTruncateMotion(motion, 0, shares); }));
  }
  std::printf("| %s | %.3f | %.4f | %.4f | %.4f | %.1f | %.1f | %.1f | %.2f |\n",
              step.title.c_str(), wanted.largest / meanEdge(mesh, start), largest,
              wanted.share([&](std::size_t v) { return std::min(safe[v], wanted.lengths[v]); }),
              wanted.share([&](std::size_t v) { return shares[v] * wanted.lengths[v]; }),
              median(step_times), median(safe_times), median(plane_times),
              median(plane_times) / median(safe_times));
}

/// The iterates of a solver that halves what is left of a step.
std::vector<Positions> iterates(const Step& step) {
  std::vector<Positions> all;
  for (int i = 1; i <= 10; ++i)
    all.push_back(
        between(step.start.vertices, step.end, (1 - std::pow(0.5, i)) / (1 - std::pow(0.5, 10))));
  return all;
}

void compareIterations(const Step& step, double radius_in_edges, int repeats) {
  const Positions& start = step.start.vertices;
  const Mesh mesh(step.start);
  const double edge = meanEdge(mesh, start);
  const std::vector<Positions> proposals = iterates(step);
  adaptive_bvh::TrustRegionRequest request;
  request.radius = radius_in_edges * edge;
  adaptive_bvh::TrustRegion region(mesh, request);
  std::vector<double> region_times, begin_times, step_times;
  Positions accepted;
  int searches = 0;
  for (int i = 0; i < repeats; ++i) {
    searches = 1;
    begin_times.push_back(milliseconds([&] { region.begin(start); }));
    region_times.push_back(begin_times.back() + milliseconds([&] {
                             for (const Positions& proposed : proposals)
                               searches += region.truncate(proposed, accepted).has_searched;
                           }));
    step_times.push_back(milliseconds([&] {
      for (std::size_t k = 0; k < proposals.size(); ++k)
        selfLargestSafeStep(Motion(mesh, k ? proposals[k - 1] : start, proposals[k]));
    }));
  }
  const Motions wanted(start, step.end), gone(start, accepted);
  std::printf("| %s | %.3f | %g | %zu | %d | %.4f | %.1f | %.1f | %.1f | %.2f |\n",
              step.title.c_str(), wanted.largest / edge, radius_in_edges, region.numPairs(),
              searches, gone.sum / wanted.sum, median(begin_times), median(region_times),
              median(step_times), median(region_times) / median(step_times));
}

}  // namespace

int main(int argc, char** argv) {
  int repeats = 9;
  std::vector<std::string> paths;
  std::vector<double> radii = {0.1, 0.2, 0.3};
  CLI::App app{"Truncated motions and trust regions"};
  app.add_option("--poses", paths, "frames in pairs: armadillo and rollers, cloth and funnel")
      ->expected(4)
      ->required();
  app.add_option("--repeats", repeats, "calls of each");
  app.add_option("--radius", radii, "of trust regions, in edges");
  CLI11_PARSE(app, argc, argv);
  std::vector<TriangleMesh> frames;
  for (const std::string& path : paths) frames.push_back(adaptive_bvh_test::loadStepFile(path));
  const auto rollers = [&](const char* title, double part) -> Step {
    return {title, frames[0], frames[1], part};
  };
  const auto cloth = [&](const char* title, double part) -> Step {
    return {title, frames[2], frames[3], part};
  };
  std::puts(
      "truncated\n\n| motion | edges | one step | displacements | planes | one step, ms | "
      "displacements, ms | planes, ms | ratio |\n|---|---|---|---|---|---|---|---|---|");
  compareTruncations(cloth("cloth and funnel, whole step", 1), repeats);
  compareTruncations(cloth("a third of it", 1. / 3), repeats);
  compareTruncations(cloth("a tenth", 0.1), repeats);
  compareTruncations(rollers("armadillo and rollers, 3 % of a step", 0.03), repeats);
  std::puts(
      "\niterations\n\n| step | edges | radius | pairs | searches | kept | begin, ms | ten, ms | "
      "ten steps, ms | ratio |\n|---|---|---|---|---|---|---|---|---|---|");
  for (const double radius : radii)
    compareIterations(cloth("cloth and funnel, 30 % of a step", 0.3), radius, repeats);
}
