// Which refit policy suits a simulation? Searches with the thesis's genetic algorithm, on its five
// scenarios or on a sequence of your own meshes, and writes the policy as JSON.
//   tune --population 10 --generations 8
//   tune --sequence frame_*.ply --obstacle table.obj --out policy.json
// Ctrl-C stops after the generation; with --checkpoint FILE the same call goes on from there.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/tuning.h"
#include "mesh_options.h"
#include "scenarios.h"

namespace {

using namespace adaptive_bvh;  // NOLINT: a program around it
using Positions = std::vector<fcl::Vector3d>;

const std::map<std::string, FitnessCriterion> kCriteria = {
    {"A", FitnessCriterion::A},         {"B", FitnessCriterion::B},
    {"AB", FitnessCriterion::AB},       {"BC", FitnessCriterion::BC},
    {"ABC", FitnessCriterion::ABC},     {"A|BC", FitnessCriterion::AOrBC},
    {"AB|BC", FitnessCriterion::ABOrBC}};

volatile std::sig_atomic_t interrupted = 0;

/// Two bodies, frame by frame, computed once.
struct Recording {
  TriangleMesh first, second;
  std::vector<Positions> first_frames, second_frames;

  SimulationWork run(const RefitPolicy& policy) const {
    AdaptiveBVHModeld a(policy), b(policy);
    fillModel(first, a);
    fillModel(second, b);
    const auto origin = fcl::Transform3d::Identity();
    SimulationWork work;
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t frame = 0; frame < first_frames.size(); ++frame) {
      work.add(a.update(first_frames[frame]));
      work.add(b.update(second_frames[frame]));
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&a, origin, &b, origin, fcl::DistanceRequestd(), result);
      work.add(a.recordedWork());
    }
    work.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return work;
  }
};

void addScenarios(int resolution, std::vector<Recording>& recordings) {
  for (const scenarios::Scenario& scenario : scenarios::thesisScenarios({resolution, false})) {
    Recording recording;
    recording.first = scenario.first.mesh();
    recording.second = scenario.second.mesh();
    for (int frame = 1; frame <= scenario.frames(); ++frame) {
      recording.first_frames.push_back(scenario.first.positions(frame));
      recording.second_frames.push_back(scenario.second.positions(frame));
    }
    recordings.push_back(std::move(recording));
  }
}

/// A sequence of meshes of one topology beside an obstacle that stands still.
Recording sequenceRecording(const std::vector<std::string>& files, const std::string& obstacle,
                            const MeshLoadOptions& load) {
  MeshLoadOptions keep = load;
  keep.weld = false;  // frames pair their vertices by number
  Recording recording;
  recording.second = loadMesh(obstacle, load);
  recording.first = loadMesh(files.front(), keep);
  for (std::size_t i = 1; i < files.size(); ++i) {
    recording.first_frames.push_back(loadMesh(files[i], keep).vertices);
    recording.second_frames.push_back(recording.second.vertices);
    if (recording.first_frames.back().size() != recording.first.vertices.size())
      throw std::runtime_error("'" + files[i] + "' has another number of vertices than '" +
                               files.front() + "'");
  }
  return recording;
}

bool report(const TuningProgress& progress) {
  const bool terminal = isatty(STDERR_FILENO);
  if (terminal || progress.generation == 0)
    std::fprintf(
        stderr,
        "%s%3.0f %%  %-24s generation %2d  best %.4f s by %s (%.3f, %.3f, %.3f)  %.0f s left%s",
        terminal ? "\r\033[K" : "", 100 * progress.share_done, toString(progress.criterion),
        progress.generation, progress.best.cost, toString(progress.best.policy.criterion),
        progress.best.policy.max_inflation, progress.best.policy.child_distance_ratio,
        progress.best.policy.min_inflation, progress.seconds_left, terminal ? "" : "\n");
  return !interrupted;
}

void print(const char* name, const RefitPolicy& policy, double cost) {
  std::printf("%-10s %-24s p_max %8.5f  k %.5f  gamma %.5f  %.4f s\n", name,
              toString(policy.criterion), policy.max_inflation, policy.child_distance_ratio,
              policy.min_inflation, cost);
}

}  // namespace

int main(int argc, char** argv) {
  TuningOptions options;
  options.progress = report;
  std::vector<std::string> sequence;
  std::string obstacle, out;
  MeshLoadOptions load;
  std::vector<int> resolutions = {1};
  std::vector<FitnessCriterion> criteria;
  bool time = false, thesis_measure = false, calibrate = false;
  CLI::App app("Searches the refit policy with the least update + query for a simulation.");
  app.add_option("--sequence", sequence, "Your meshes, one a frame, in order, of one topology");
  app.add_option("--obstacle", obstacle, "The mesh to which distances are computed");
  app.add_option("--resolution", resolutions, "Of the five scenarios; several do");
  app.add_option("--criterion", criteria, "Only these: A, B, AB, BC, ABC, A|BC, AB|BC")
      ->transform(CLI::CheckedTransformer(kCriteria));
  app.add_option("--population", options.population, "Policies at a time");
  app.add_option("--generations", options.generations, "For each criterion");
  app.add_option("--seed", options.seed, "The same seed finds the same policy (not with --time)");
  app.add_option("--max-inflation", options.max_inflation.high, "Search p_max up to this");
  app.add_flag("--time", time, "Minimise measured seconds, as the thesis, not counted work");
  app.add_flag("--calibrate", calibrate, "Measure this machine's costs first");
  app.add_flag("--thesis-measure", thesis_measure, "Inflation against the original radius alone");
  app.add_option("--checkpoint", options.checkpoint, "Go on from here, if it is there");
  app.add_option("--out", out, "Write the result as JSON");
  tools::addMeshOptions(app, load);
  try {
    app.parse(argc, argv);
    if (sequence.empty() != obstacle.empty() || sequence.size() == 1)
      throw std::runtime_error("--sequence needs two meshes or more, and an --obstacle");
    if (!criteria.empty()) options.criteria = criteria;
    if (time) options.objective = TuningObjective::MeasuredTime;
    if (thesis_measure) options.base = RefitPolicy::thesis(FitnessCriterion::ABOrBC);
    if (calibrate) {
      options.costs = WorkCosts::measured(options.base.propagation);
      const WorkCosts& c = options.costs;
      std::printf(
          "ns: volume test %.0f, triangle test %.0f, propagation %.1f, "
          "refit of a leaf %.0f, of an inner node %.0f + %.0f a triangle\n",
          c.bv_test, c.leaf_test, c.propagated, c.refitted_leaf, c.refitted_inner,
          c.refitted_primitive);
    }
    std::vector<Recording> recordings;
    if (sequence.empty())
      for (int resolution : resolutions) addScenarios(resolution, recordings);
    else
      recordings.push_back(sequenceRecording(sequence, obstacle, load));
    const Simulation simulation = [&](const RefitPolicy& policy) {
      SimulationWork sum;
      for (const Recording& recording : recordings) sum += recording.run(policy);
      return sum;
    };

    std::signal(SIGINT, [](int) { interrupted = 1; });
    const TuningResult result = tune(simulation, options);
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r\033[K");
    const auto cost = [&](const RefitPolicy& policy) {
      const SimulationWork work = simulation(policy);
      return time ? work.seconds : options.costs.seconds(work);
    };
    for (const TunedPolicy& tuned : result.by_criterion) print("tuned", tuned.policy, tuned.cost);
    print("BEST", result.best().policy, result.best().cost);
    print("default", RefitPolicy(), cost(RefitPolicy()));
    const RefitPolicy thesis = RefitPolicy::thesis(FitnessCriterion::ABOrBC);
    print("thesis", thesis, cost(thesis));
    if (!result.finished) std::printf("Stopped early.\n");
    if (!out.empty() && !(std::ofstream(out) << toJson(result) << '\n'))
      throw std::runtime_error("cannot write '" + out + "'");
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
  } catch (const std::exception& error) {
    std::cerr << "tune: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
