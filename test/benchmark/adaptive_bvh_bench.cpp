// Update + exact distance of two deforming meshes: this library, the rows of thesis Table 2,
// Larsson and Akenine-Moeller, and FCL's own ways, in one run. docs/experiment.md has its tables.
#include <cstdio>
#include <iostream>

#include <CLI/CLI.hpp>

#include "progress_bar.h"
#include "report.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include "pose_files.h"
#endif

namespace {

using namespace adaptive_bvh_bench;  // NOLINT: this is its program
using scenarios::Scenario;

struct Options {
  std::vector<int> resolutions = {1}, strides = {1};
  std::string orientation = "general";
  std::vector<std::string> scenarios, methods, poses;
  std::string json, csv;
  bool further = false, split = false, slow = false, quiet = false, describe = false;
  RunOptions run;
};

bool isNamed(const std::string& name, const std::vector<std::string>& wanted) {
  return wanted.empty() || std::any_of(wanted.begin(), wanted.end(), [&](const std::string& w) {
           return name.find(w) != std::string::npos;
         });
}

/// The chosen methods; without a choice, all except the slow ones above thesis size.
std::vector<MethodKind> chosenMethods(const Options& options) {
  const bool large = *std::max_element(options.resolutions.begin(), options.resolutions.end()) > 1;
  std::vector<MethodKind> chosen;
  for (const auto& list : {adaptiveMethods(), larssonMethods(), fclMethods()})
    for (const MethodKind& kind : list) {
      const bool named = std::find(options.methods.begin(), options.methods.end(), kind.key) !=
                         options.methods.end();
      if (named ||
          (options.methods.empty() && (kind.note != MethodKind::Slow || options.slow || !large)))
        chosen.push_back(kind);
    }
  if (chosen.empty()) throw std::runtime_error("no method of that name; --help lists them");
  return chosen;
}

std::vector<Scenario> chosenScenarios(const Options& options, int resolution, int stride,
                                      bool aligned) {
  const scenarios::Options scene = {resolution, aligned};
  std::vector<Scenario> all = scenarios::thesisScenarios(scene);
  if (options.further)
    for (Scenario& scenario : scenarios::furtherScenarios(scene))
      all.push_back(std::move(scenario));
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  if (options.poses.size() % 2 != 0) throw std::runtime_error("--poses needs pairs of files");
  for (std::size_t i = 0; i < options.poses.size(); i += 2) {
    const Scenario scenario = loadPoses(options.poses[i], options.poses[i + 1], options.split);
    all.push_back(aligned ? scenario : scenarios::turnedGenerically(scenario));
  }
#endif
  std::vector<Scenario> chosen;
  for (const Scenario& scenario : all)
    if (isNamed(scenario.name, options.scenarios))
      chosen.push_back(scenarios::withStride(scenario, stride));
  if (chosen.empty()) throw std::runtime_error("no scenario of that name");
  return chosen;
}

/// Calls what(resolution, stride) for all requested combinations.
template <typename What>
void forEachSize(const Options& options, const What& what) {
  for (int resolution : options.resolutions)
    for (int stride : options.strides) what(resolution, stride);
}

/// What the scenarios are: sizes, and how far vertices move a frame.
void describe(const Options& options) {
  forEachSize(options, [&](int resolution, int stride) {
    std::printf(
        "\n| scenario, resolution %d, stride %d | body | vertices | triangles | frames | step in "
        "edges, mean | largest | in diagonals, mean | largest |\n| --- | --- | ---: | ---: | "
        "---: | ---: | ---: | ---: | ---: |\n",
        resolution, stride);
    for (const Scenario& scenario : chosenScenarios(options, resolution, stride, false))
      for (const scenarios::Body* body : {&scenario.first, &scenario.second}) {
        const scenarios::MotionSize step = scenarios::measureMotion(*body);
        std::printf("| %s | %s | %zu | %zu | %d | %.3f | %.2f | %.4f | %.3f |\n",
                    body == &scenario.first ? scenario.name.c_str() : "", body->name().c_str(),
                    body->vertices(), body->triangles().size(), body->frames(), step.mean_in_edges,
                    step.largest_in_edges, step.mean_in_diagonals, step.largest_in_diagonals);
      }
  });
}

void run(Options options) {
  const std::vector<MethodKind> kinds = chosenMethods(options);
  std::vector<Series> all;
  forEachSize(options, [&](int resolution, int stride) {
    for (bool aligned : {false, true}) {
      if (options.orientation == (aligned ? "general" : "aligned")) continue;
      Series series;
      series.resolution = resolution;
      series.stride = stride;
      series.aligned = aligned;
      const std::vector<Scenario> chosen = chosenScenarios(options, resolution, stride, aligned);
      {
        const ProgressBar bar(!options.quiet);
        for (std::size_t i = 0; i < chosen.size(); ++i) {
          options.run.progress = [&](double share, const std::string& what) {
            bar.show((double(i) + share) / double(chosen.size()), what);
          };
          series.scenarios.push_back(runScenario(chosen[i], kinds, options.run));
        }
      }
      writeTables(std::cout, series, kinds);
      all.push_back(std::move(series));
    }
  });
  if (!options.json.empty()) writeJson(options.json, all, kinds);
  if (!options.csv.empty()) writeCsv(options.csv, all, kinds);

  for (const Series& series : all)
    for (const ScenarioResult& scenario : series.scenarios)
      for (std::size_t k = 0; k < kinds.size(); ++k)
        if (scenario.methods[k].wrong_frames > 0 && kinds[k].note != MethodKind::Wrong)
          throw std::runtime_error(kinds[k].title + " disagrees with the oracle in " +
                                   std::to_string(scenario.methods[k].wrong_frames) +
                                   " frames of " + scenario.name);
}

std::string methodNames() {
  std::string names;
  for (const auto& list : {adaptiveMethods(), larssonMethods(), fclMethods()})
    for (const MethodKind& kind : list) names += (names.empty() ? "" : ", ") + kind.key;
  return names;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Update + exact distance of two deforming meshes, many ways, in one process. Prints markdown "
      "tables. Ends with status 1 when a row that must be exact is not.");
  app.add_option("--scenario", options.scenarios, "Only scenarios whose name holds this");
  app.add_flag("--further", options.further, "The four further scenarios as well");
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  app.add_option("--poses", options.poses,
                 "Two poses of one mesh as a scenario: FROM TO ... It goes there and back in " +
                     std::to_string(kPoseSteps) + " steps, above a plate");
  app.add_flag("--split", options.split,
               "Of --poses: not a plate, but the mesh's largest connected part against its others");
#endif
  app.add_option("--resolution", options.resolutions, "Triangles times this squared; several do");
  app.add_option("--stride", options.strides,
                 "Only every STRIDE-th step, so that motions are larger; several do")
      ->check(CLI::Range(1, 1000));
  app.add_option("--orientation", options.orientation, "general, aligned, or both")
      ->check(CLI::IsMember({"general", "aligned", "both"}));
  app.add_flag("--moving", options.run.moving, "The objects move too: their transforms change");
  app.add_option("--method", options.methods, "Only these: " + methodNames());
  app.add_flag("--slow", options.slow, "The slowest methods above thesis size, too");
  app.add_option("--repeats", options.run.repeats, "Runs of everything; tables show medians")
      ->check(CLI::Range(1, 1000));
  app.add_option("--seed", options.run.seed, "Of the order in which methods take turns");
  app.add_option("--json", options.json, "Write all, frame by frame, to this file");
  app.add_option("--csv", options.csv, "Write a row per scenario and method to this file");
  app.add_flag("--describe", options.describe, "Only say how large the scenarios and motions are");
  app.add_flag("--quiet", options.quiet, "No progress bar");
  try {
    app.parse(argc, argv);
    options.describe ? describe(options) : run(options);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
  } catch (const CLI::Error& error) {
    std::cerr << "adaptive_bvh_bench: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "adaptive_bvh_bench: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
