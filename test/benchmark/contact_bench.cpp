// Update + contact of deforming meshes: self-collision, collision, distance where meshes nearly
// touch, and what touches between two frames; this library, FCL, and, where their packages are
// there, Embree and CGAL. In one run.
#include <iostream>

#include <CLI/CLI.hpp>

#include "contact_bodies.h"
#include "contact_report.h"
#include "progress_bar.h"
#include "proximity_questions.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include "pose_files.h"
#endif

namespace {

using namespace adaptive_bvh_bench;  // NOLINT: this is its program
using scenarios::Body;
using scenarios::Scenario;

constexpr Job kJobs[] = {Job::SelfCollision, Job::Collide, Job::Distance, Job::Continuous};

struct Options {
  std::vector<int> resolutions;
  std::string orientation = "general";
  std::vector<std::string> scenarios, methods, jobs, poses;
  std::string json, csv;
  bool split = false, quiet = false;
  int threads = 1;
  ContactRunOptions run;
};

std::vector<ContactKind> contactMethods(int threads) {
  std::vector<ContactKind> all = fclContactMethods();
  const auto append = [&all](const std::vector<ContactKind>& kinds) {
    all.insert(all.end(), kinds.begin(), kinds.end());
  };
#ifdef ADAPTIVE_BVH_HAS_EMBREE
  append(embreeContactMethods());
  append(embreeContinuousMethods());
#endif
#ifdef ADAPTIVE_BVH_HAS_CGAL
  append(cgalContactMethods());
#endif
  append(adaptiveContactMethods(threads));
  append(continuousContactMethods(threads));
  return all;
}

std::vector<ContactKind> chosenMethods(const Options& options) {
  std::vector<ContactKind> chosen;
  for (const ContactKind& kind : contactMethods(options.threads))
    if (options.methods.empty() ||
        std::count(options.methods.begin(), options.methods.end(), kind.key))
      chosen.push_back(kind);
  if (chosen.empty()) throw std::runtime_error("no method of that name; --help lists them");
  return chosen;
}

std::string methodNames() {
  std::string names;
  for (const ContactKind& kind : contactMethods(2)) names += (names.empty() ? "" : ", ") + kind.key;
  return names;
}

/// Of a self-collision: the second body is not used.
Scenario alone(const Body& body, bool aligned) {
  const Scenario scenario = {body.name(), body, body};
  return aligned ? scenario : scenarios::turnedGenerically(scenario);
}

/// The rows that are computed.
std::vector<ContactCase> bodyCases(int resolution, bool aligned) {
  std::vector<ContactCase> all;
  for (const Body& body :
       {scenarios::foldingSheet(resolution), scenarios::helmet(resolution),
        scenarios::coilingCable(resolution), scenarios::crumpledSheet(resolution),
        scenarios::pressedRods(resolution)})
    all.push_back({Job::SelfCollision, alone(body, aligned)});
  for (Job job : {Job::Collide, Job::Distance})
    all.push_back({job, scenarios::pressedRodsPair({resolution, aligned})});
  for (const Body& body :
       {scenarios::foldingSheet(resolution), scenarios::crumpledSheet(resolution),
        scenarios::pressedRods(resolution)})
    all.push_back({Job::Continuous, alone(body, aligned)});
  return all;
}

/// Those of files. The whole mesh with itself; and with the plate, or its parts with each other.
std::vector<ContactCase> poseCases(const Options& options, bool aligned) {
  std::vector<ContactCase> all;
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  if (options.poses.size() % 2 != 0) throw std::runtime_error("--poses needs pairs of files");
  for (std::size_t i = 0; i < options.poses.size(); i += 2) {
    const auto load = [&](bool split) {
      const Scenario scenario = loadPoses(options.poses[i], options.poses[i + 1], split);
      return aligned ? scenario : scenarios::turnedGenerically(scenario);
    };
    all.push_back({Job::SelfCollision, load(false)});
    for (Job job : {Job::Collide, Job::Distance}) all.push_back({job, load(options.split)});
    // From one pose to the other in one step.
    all.push_back({Job::Continuous, scenarios::withStride(load(false), kPoseSteps / 2)});
  }
#endif
  return all;
}

bool isChosen(const Options& options, const ContactCase& contact_case) {
  const auto named = [&](const std::string& name) {
    return contact_case.scenario.name.find(name) != std::string::npos;
  };
  const std::string job = toString(contact_case.job);
  return (options.jobs.empty() || std::count(options.jobs.begin(), options.jobs.end(), job)) &&
         (options.scenarios.empty() ||
          std::any_of(options.scenarios.begin(), options.scenarios.end(), named));
}

/// With their resolutions; files are measured once.
std::vector<std::pair<int, ContactCase>> chosenCases(const Options& options) {
  const bool aligned = options.orientation == "aligned";
  std::vector<std::pair<int, ContactCase>> chosen;
  const auto choose = [&](int resolution, const std::vector<ContactCase>& cases) {
    for (const ContactCase& contact_case : cases)
      if (isChosen(options, contact_case)) chosen.emplace_back(resolution, contact_case);
  };
  choose(1, poseCases(options, aligned));
  for (int resolution : options.resolutions) choose(resolution, bodyCases(resolution, aligned));
  if (chosen.empty()) throw std::runtime_error("no scenario of that name");
  return chosen;
}

/// Returns whether all of our rows were right.
bool run(Options options) {
  const std::vector<ContactKind> kinds = chosenMethods(options);
  const auto cases = chosenCases(options);
  std::vector<ContactResult> all;
  {
    const ProgressBar bar(!options.quiet);
    for (std::size_t i = 0; i < cases.size(); ++i) {
      options.run.progress = [&](double share, const std::string& what) {
        bar.show((double(i) + share) / double(cases.size()), what);
      };
      all.push_back(runContactCase(cases[i].second, kinds, options.run));
      all.back().resolution = cases[i].first;
    }
  }
  writeContactSummary(std::cout, all, kinds);
  for (Job job : kJobs)
    if (std::any_of(all.begin(), all.end(), [job](const auto& r) { return r.job == job; }))
      writeContactTable(std::cout, job, all);
  if (!options.json.empty()) writeContactJson(options.json, all);
  if (!options.csv.empty()) writeContactCsv(options.csv, all);
  return std::none_of(all.begin(), all.end(), [](const auto& r) { return r.oursFailed(); });
}

void addOptions(CLI::App& app, Options& options) {
  app.add_option("--job", options.jobs, "Only these: self-collision, collide, distance, continuous")
      ->check(CLI::IsMember({"self-collision", "collide", "distance", "continuous"}));
  app.add_option("--scenario", options.scenarios, "Only scenarios whose name holds this");
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  app.add_option("--poses", options.poses,
                 "Two poses of one mesh as a scenario: FROM TO ... It goes there and back in " +
                     std::to_string(kPoseSteps) + " steps, above a plate");
  app.add_flag("--split", options.split,
               "Of --poses: not a plate, but the mesh's largest connected part against its others");
#endif
  app.add_option(
      "--resolution", options.resolutions,
      "Triangles of what is not from files times this squared; several do. By default 1, and "
      "nothing computed beside --poses");
  app.add_option("--orientation", options.orientation, "general or aligned")
      ->check(CLI::IsMember({"general", "aligned"}));
  app.add_option("--method", options.methods, "Only these: " + methodNames());
  app.add_option("--repeats", options.run.repeats, "Runs of everything; tables show medians")
      ->check(CLI::Range(1, 1000));
  app.add_option("--seed", options.run.seed, "Of the order in which methods take turns");
  app.add_option("--json", options.json, "Write all, frame by frame, to this file");
  app.add_option("--csv", options.csv, "Write a row per case and method to this file");
  app.add_option("--threads", options.threads, "Adds a row of ours on so many threads")
      ->check(CLI::Range(1, 256));
  app.add_flag("--quiet", options.quiet, "No progress bar");
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Update + self-collision, collision, distance in near contact, and continuous collision, ms "
      "a frame, many ways, in one process. Prints markdown tables. Ends with status 1 when one of "
      "our rows is wrong.");
  addOptions(app, options);
  const std::function<bool()> runProximity = addProximityQuestions(app);
  try {
    app.parse(argc, argv);
    if (app.got_subcommand("proximity")) return runProximity() ? 0 : 1;
    if (options.resolutions.empty() && options.poses.empty()) options.resolutions = {1};
    return run(options) ? 0 : 1;
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::Error& error) {
    std::cerr << "contact_bench: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "contact_bench: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
