// Update + proximity of deforming meshes: pairs within a distance, nearer than a distance, closest
// points, rays; this library, FCL, and Embree where its package is there. In one run.
#include "proximity_questions.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <numeric>
#include <random>

#include "contact_bodies.h"
#include "contact_judge.h"
#include "median.h"
#include "proximity_method.h"
#include "stopwatch.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include "pose_files.h"
#endif

namespace adaptive_bvh_bench {
namespace {

struct ProximityOptions {
  int resolution = 1, repeats = 3, threads = 1, many = 100000;
  std::vector<std::string> poses, questions, methods;
};

/// The mean length of an edge.
double meanEdge(const scenarios::Body& body) {
  const Positions positions = body.positions(0);
  double sum = 0;
  for (const fcl::Triangle& t : body.triangles())
    for (int k = 0; k < 3; ++k) sum += (positions[t[k]] - positions[t[(k + 1) % 3]]).norm();
  return sum / 3 / double(body.triangles().size());
}

/// Points about the body's surface, up to some edges off it; directions of any kind.
void addPoints(ProximityCase& c, int count, double edge) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  const Positions positions = c.scenario.first.positions(0);
  for (int i = 0; i < count; ++i) {
    const Point off(number(random), number(random), number(random));
    c.points.push_back(positions[random() % positions.size()] + 8 * edge * off);
    c.directions.emplace_back(number(random), number(random), number(random));
  }
}

void addCases(const ProximityOptions& options, const scenarios::Scenario& whole,
              const scenarios::Scenario& parts, std::vector<ProximityCase>& cases) {
  const double edge = meanEdge(whole.first);
  for (const double edges : {0.5, 2.}) {
    char text[64];
    std::snprintf(text, sizeof(text), "within %g edges", edges);
    cases.push_back({Question::Pairs, std::string(text) + ", self", whole, true, edges * edge});
    cases.push_back({Question::Pairs, std::string(text) + ", two", parts, false, edges * edge});
  }
  for (const double share : {0.5, 0.98, 1.5}) {
    char text[64];
    std::snprintf(text, sizeof(text), "nearer than %g of the least distance", share);
    cases.push_back({Question::Nearer, text, parts, false, share});
  }
  const auto addMany = [&](Question question, const char* title) {
    cases.push_back({question, title, whole, true, 0});
    addPoints(cases.back(), options.many, edge);
  };
  addMany(Question::Points, "points");
  addMany(Question::Rays, "rays");
  addMany(Question::AnyRays, "any hit of rays");
}

std::vector<ProximityCase> casesOf(const ProximityOptions& options) {
  std::vector<ProximityCase> cases;
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  for (std::size_t i = 0; i + 1 < options.poses.size(); i += 2) {
    const auto load = [&](bool split) {
      return scenarios::turnedGenerically(loadPoses(options.poses[i], options.poses[i + 1], split));
    };
    addCases(options, load(false), load(true), cases);
  }
#endif
  if (options.poses.empty()) {
    const auto rods = scenarios::pressedRods(options.resolution);
    addCases(options, {rods.name(), rods, rods}, scenarios::pressedRodsPair({options.resolution}),
             cases);
  }
  return cases;
}

/// Whether a title holds one of these; all do where there are none.
bool isAmong(const std::vector<std::string>& parts, const std::string& title) {
  return parts.empty() || std::any_of(parts.begin(), parts.end(), [&](const std::string& part) {
           return title.find(part) != std::string::npos;
         });
}

std::vector<ProximityKind> methods(const ProximityCase& c, const ProximityOptions& options) {
  std::vector<ProximityKind> all = adaptiveProximityMethods(options.threads);
  const auto append = [&](const std::vector<ProximityKind>& kinds) {
    all.insert(all.end(), kinds.begin(), kinds.end());
  };
#ifdef ADAPTIVE_BVH_HAS_EMBREE
  append(embreeProximityMethods());
#endif
  append(fclProximityMethods());
  std::vector<ProximityKind> able;
  for (const ProximityKind& kind : all)
    if (std::count(kind.questions.begin(), kind.questions.end(), c.question) &&
        isAmong(options.methods, kind.title))
      able.push_back(kind);
  return able;
}

/// What is wrong with ours where an answer differs from it: pairs, by their exact distances; or the
/// largest difference of numbers, relative to ours.
struct Difference {
  long pairs = 0;
  double number = 0;

  void add(const ProximityCase& c, const Frame& frame, const ProximityAnswer& ours,
           const ProximityAnswer& other) {
    std::vector<std::pair<unsigned, unsigned>> differing;
    std::set_symmetric_difference(ours.pairs.begin(), ours.pairs.end(), other.pairs.begin(),
                                  other.pairs.end(), std::back_inserter(differing));
    if (!differing.empty()) {
      const scenarios::Mesh first{frame.first, c.scenario.first.triangles()},
          second = c.is_self ? first : scenarios::Mesh{frame.second, c.scenario.second.triangles()};
      for (const auto& pair : differing) {
        const double distance = exactDistance(first, pair.first, second, pair.second);
        const bool is_ours = std::binary_search(ours.pairs.begin(), ours.pairs.end(), pair);
        pairs += (distance <= c.distance) != is_ours &&
                 std::abs(distance - c.distance) > 1e-12 * (1 + c.distance);
      }
    }
    for (std::size_t i = 0; i < ours.numbers.size(); ++i) {
      const double a = ours.numbers[i], b = other.numbers[i];
      if (std::isinf(a) != std::isinf(b)) ++pairs;
      if (!std::isinf(a) && !std::isinf(b))
        number = std::max(number, std::abs(a - b) / (std::abs(a) + 1e-3));
    }
  }
};

struct Row {
  std::string title;
  std::vector<double> update_ms, ask_ms;
  std::size_t found = 0;
  Difference difference;
};

/// All methods take turns in every frame.
std::vector<Row> run(const ProximityCase& c, const ProximityOptions& options) {
  const auto kinds = methods(c, options);
  std::vector<Row> rows(kinds.size());
  std::mt19937 random(1);
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    std::vector<std::unique_ptr<ProximityMethod>> all;
    std::vector<std::size_t> order(kinds.size());
    std::iota(order.begin(), order.end(), 0u);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      rows[k].title = kinds[k].title;
      rows[k].update_ms.push_back(0);
      rows[k].ask_ms.push_back(0);
      all.push_back(kinds[k].make(c));
    }
    const int frames = c.is_self ? c.scenario.first.frames() : c.scenario.frames();
    Frame frame;
    for (int f = 1; f <= frames; ++f) {
      c.scenario.first.positions(f, frame.first);
      if (!c.is_self) c.scenario.second.positions(f, frame.second);
      std::shuffle(order.begin(), order.end(), random);
      for (const std::size_t k : order) {
        rows[k].update_ms.back() += milliseconds([&] { all[k]->update(frame); }) / frames;
        rows[k].ask_ms.back() += milliseconds([&] { all[k]->ask(); }) / frames;
      }
      if (repeat > 0) continue;
      const ProximityAnswer ours = all[0]->answer();
      for (std::size_t k = 0; k < all.size(); ++k) {
        const ProximityAnswer answer = all[k]->answer();
        rows[k].found += answer.pairs.size();
        rows[k].difference.add(c, frame, ours, answer);
      }
    }
  }
  return rows;
}

/// The least distance of the two bodies over all frames, for the cases that ask whether they are
/// nearer than a share of it.
double leastDistance(const scenarios::Scenario& scenario) {
  double least = std::numeric_limits<double>::infinity();
  for (int f = 1; f <= scenario.frames(); ++f)
    least =
        std::min(least, exactDistance({scenario.first.positions(f), scenario.first.triangles()},
                                      {scenario.second.positions(f), scenario.second.triangles()}));
  return least;
}

void write(const ProximityCase& c, const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    std::vector<double> ratios;
    for (std::size_t r = 0; r < row.ask_ms.size(); ++r)
      ratios.push_back((row.update_ms[r] + row.ask_ms[r]) /
                       (rows[0].update_ms[r] + rows[0].ask_ms[r]));
    std::printf("| %s | %s | %s | %.3f | %.3f | %.2f | %zu | %ld | %.0e |\n",
                c.scenario.name.c_str(), c.title.c_str(), row.title.c_str(), median(row.update_ms),
                median(row.ask_ms), median(ratios), row.found, row.difference.pairs,
                row.difference.number);
  }
  std::fflush(stdout);
}

/// Returns whether our pairs are right, wherever methods differ.
bool run(const ProximityOptions& options) {
  std::printf(
      "| scenario | question | method | update | query | takes times ours | pairs | of those "
      "wrong in ours | largest difference |\n| --- | --- | --- | ---: | ---: | ---: | ---: | ---: "
      "| "
      "---: |\n");
  bool agree = true;
  for (ProximityCase& c : casesOf(options)) {
    if (!isAmong(options.questions, c.title)) continue;
    if (c.question == Question::Nearer) c.distance *= leastDistance(c.scenario);
    const std::vector<Row> rows = run(c, options);
    write(c, rows);
    if (c.question == Question::Pairs)
      agree &= std::all_of(rows.begin(), rows.end(),
                           [](const Row& row) { return row.difference.pairs == 0; });
  }
  return agree;
}

}  // namespace

std::function<bool()> addProximityQuestions(CLI::App& program) {
  const auto options = std::make_shared<ProximityOptions>();
  CLI::App& app = *program.add_subcommand(
      "proximity",
      "Update + pairs within a distance, nearer than a distance, closest points and rays, ms a "
      "frame. Ends with status 1 when one of our pairs is wrong.");
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  app.add_option("--poses", options->poses,
                 "Two poses of one mesh: FROM TO ...; else twisted rods");
#endif
  app.add_option("--question", options->questions, "Only cases whose title holds this");
  app.add_option("--method", options->methods, "Only methods whose name holds this");
  app.add_option("--resolution", options->resolution, "Triangles of the rods times this squared");
  app.add_option("--repeats", options->repeats, "Tables show medians")->check(CLI::Range(1, 1000));
  app.add_option("--many", options->many, "Points and rays")->check(CLI::Range(1, 10000000));
  app.add_option("--threads", options->threads, "Adds a row of ours on so many threads");
  return [options] { return run(*options); };
}

}  // namespace adaptive_bvh_bench
