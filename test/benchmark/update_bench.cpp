// Updates alone, of AdaptiveBVHModel and of DeformableMesh: against the floor of what memory
// allows, of a few vertices against all, on several threads against one, against a copy of as many
// bytes; and one against the other.
// Everything interleaved in one process; medians of ratios.
#include <cstdio>
#include <functional>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "deformable/mesh_state.h"
#include "median.h"
#include "scenarios.h"
#include "stopwatch.h"

namespace {

using adaptive_bvh_bench::median;
using Model = adaptive_bvh::AdaptiveBVHModeld;
using Mesh = adaptive_bvh::DeformableMesh;
using Positions = std::vector<scenarios::Point>;

template <typename Work>
double nanoseconds(Work&& work) {
  return 1e6 * adaptive_bvh_bench::milliseconds(work);
}

std::vector<Positions> framesOf(const scenarios::Body& body) {
  std::vector<Positions> frames;
  for (int frame = 0; frame < body.frames(); ++frame) frames.push_back(body.positions(frame));
  return frames;
}

Model modelOf(const scenarios::Body& body, adaptive_bvh::FitnessCriterion criterion) {
  adaptive_bvh::RefitPolicy policy;
  policy.criterion = criterion;
  Model model(policy);
  fillModel(body.mesh(), model);
  return model;
}

/// What a body has: nodes or triangles.
int size(const Model& model) { return model.getNumBVs(); }
int size(const Mesh& mesh) { return static_cast<int>(mesh.triangles().size()); }

/// Runs two ways in turn over all frames, and after each what is not timed; prints nanoseconds a
/// node or triangle of both, and the ratio.
void compare(const std::string& what, int count, int rounds, std::size_t frames,
             const std::function<void(std::size_t)>& slower,
             const std::function<void(std::size_t)>& after_slower,
             const std::function<void(std::size_t)>& faster,
             const std::function<void(std::size_t)>& after_faster) {
  std::vector<double> a, b, ratio;
  for (int round = 0; round < rounds; ++round) {
    double sum_a = 0, sum_b = 0;
    for (std::size_t frame = 0; frame < frames; ++frame) {
      sum_a += nanoseconds([&] { slower(frame); });
      after_slower(frame);
      sum_b += nanoseconds([&] { faster(frame); });
      after_faster(frame);
    }
    const double all = double(frames) * count;
    a.push_back(sum_a / all);
    b.push_back(sum_b / all);
    ratio.push_back(sum_a / sum_b);
  }
  std::printf("| %s | %d | %.2f | %.2f | %.2f |\n", what.c_str(), count, median(a), median(b),
              median(ratio));
  std::fflush(stdout);
}

void nothing(std::size_t) {}

/// `unit`: what the times are divided by.
void heading(const char* what, const char* unit, const char* a, const char* b) {
  std::printf("\n| %s | %ss | %s, ns a %s | %s | ratio |\n| --- | ---: | ---: | ---: | ---: |\n",
              what, unit, a, unit, b);
}

/// Of a model every vertex read and written once, and one number on one cache line of every node of
/// FCL's.
void floors(int rounds, int largest) {
  heading("update of a model without refits, helmet", "node", "update", "floor");
  for (int resolution = 1; resolution <= largest; resolution *= 2) {
    const scenarios::Body body = scenarios::helmet(resolution);
    const std::vector<Positions> frames = framesOf(body);
    Model model = modelOf(body, adaptive_bvh::FitnessCriterion::RefitNone);
    fcl::BVHModel<fcl::RSSd> plain;
    fillModel(body.mesh(), plain);
    compare(
        "x " + std::to_string(resolution * resolution), model.getNumBVs(), rounds, frames.size(),
        [&](std::size_t i) { model.update(frames[i]); }, nothing,
        [&](std::size_t i) {
          std::copy(frames[i].begin(), frames[i].end(), plain.vertices);
          for (int n = 0; n < plain.getNumBVs(); ++n) plain.getBV(n).bv.r += 1e-12;
        },
        nothing);
  }
}

/// Of a mesh every vertex read and written once; and a model that refits every volume.
void meshes(int rounds, int largest) {
  heading("update of a mesh, helmet", "triangle", "update", "copy of the positions");
  for (int resolution = 1; resolution <= largest; resolution *= 2) {
    const scenarios::Body body = scenarios::helmet(resolution);
    const std::vector<Positions> frames = framesOf(body);
    Mesh mesh(body.mesh());
    Positions copy = frames.front();
    compare(
        "x " + std::to_string(resolution * resolution), size(mesh), rounds, frames.size(),
        [&](std::size_t i) { mesh.update(frames[i]); }, nothing,
        [&](std::size_t i) { std::copy(frames[i].begin(), frames[i].end(), copy.begin()); },
        nothing);
  }
  heading("every volume, helmet", "triangle", "update of a model, RefitAll", "of a mesh");
  for (int resolution = 1; resolution <= largest; resolution *= 2) {
    const scenarios::Body body = scenarios::helmet(resolution);
    const std::vector<Positions> frames = framesOf(body);
    Model model = modelOf(body, adaptive_bvh::FitnessCriterion::RefitAll);
    Mesh mesh(body.mesh());
    compare(
        "x " + std::to_string(resolution * resolution), size(mesh), rounds, frames.size(),
        [&](std::size_t i) { model.update(frames[i]); }, nothing,
        [&](std::size_t i) { mesh.update(frames[i]); }, nothing);
  }
}

/// The bytes that an update of all vertices of a mesh reads and writes, in as many passes as it
/// has.
struct Traffic {
  explicit Traffic(const Mesh& mesh) {
    const adaptive_bvh::MeshState& state = adaptive_bvh::stateOf(mesh);
    const adaptive_bvh::VertexSlots& slots = state.tree.slots();
    const std::size_t point = sizeof(state.vertices[0]), vertices = state.vertices.size(),
                      position = sizeof(state.tree.positions()[0]),
                      residual = sizeof(state.tree.residuals()[0]);
    read += 2 * point * vertices;  // their box and displacements: the new and the old positions
    read += point * vertices;      // the copy
    written += point * vertices;
    read += (sizeof(slots.vertices()[0]) + point) * slots.size();  // positions of the tree
    written += (position + residual) * slots.size();
    read += sizeof(slots.leafSlots()[0]) * slots.leaves() + position * slots.size();  // boxes
    read += sizeof(adaptive_bvh::WideNode) * std::size_t(state.tree.size());
    written += sizeof(adaptive_bvh::Boxes4) * std::size_t(state.tree.size());
  }

  std::size_t read = 0, written = 0;
};

/// An update of a mesh, and a copy that reads and writes as many bytes together.
void bytes(int rounds, int largest) {
  heading("update of a mesh and its bytes, helmet", "triangle", "update", "copy of as many bytes");
  constexpr int kResolutions[] = {6, 14, 37};
  constexpr int kFrames = 4;  // of the largest mesh, so that all fit in memory
  for (int resolution : kResolutions) {
    if (resolution > 3 * largest) break;
    const scenarios::Body body = scenarios::helmet(resolution);
    std::vector<Positions> frames;
    for (int frame = 0; frame < kFrames; ++frame)
      frames.push_back(body.positions(frame * body.frames() / kFrames));
    Mesh mesh(body.mesh());
    const Traffic traffic(mesh);
    std::vector<char> from((traffic.read + traffic.written) / 2, 1), to = from;
    const auto perTriangle = [&](std::size_t of_all) -> std::string {
      return std::to_string((of_all + std::size_t(size(mesh)) / 2) / std::size_t(size(mesh)));
    };
    compare(
        perTriangle(traffic.read) + " read + " + perTriangle(traffic.written) + " written",
        size(mesh), rounds, frames.size(), [&](std::size_t i) { mesh.update(frames[i]); }, nothing,
        [&](std::size_t) { std::copy(from.begin(), from.end(), to.begin()); }, nothing);
  }
}

constexpr int kPokes[] = {1, 2, 4};

/// The sheet of the local poke, and which of its vertices move where in each frame.
struct Poke {
  explicit Poke(int resolution)
      : scenario(scenarios::furtherScenarios({resolution, false}).front()),
        frames(framesOf(scenario.first)),
        indices(frames.size()),
        to(frames.size()) {
    for (std::size_t i = 0; i < frames.size(); ++i)
      for (std::size_t v = 0; v < frames[i].size(); ++v)
        if (frames[i][v] != frames[(i + frames.size() - 1) % frames.size()][v]) {
          indices[i].push_back(unsigned(v));
          to[i].push_back(frames[i][v]);
        }
  }

  scenarios::Scenario scenario;
  std::vector<Positions> frames;
  std::vector<std::vector<unsigned>> indices;
  std::vector<Positions> to;
};

/// Local poke: the sheet's 1 % of vertices that move, by number, against all. Between the updates
/// of a model the tool moves and recorded queries run, outside of the clock, so that refits go by
/// what they meet.
void partial(int rounds) {
  heading("local poke, sheet, model", "node", "update of all", "of moved vertices");
  for (int resolution : kPokes) {
    const Poke poke(resolution);
    Model all = modelOf(poke.scenario.first, adaptive_bvh::FitnessCriterion::AB), some = all;
    Model tool = modelOf(poke.scenario.second, adaptive_bvh::FitnessCriterion::AB);
    const std::vector<Positions> tool_frames = framesOf(poke.scenario.second);
    const auto ask = [&](const Model& model, std::size_t frame) {
      tool.update(tool_frames[frame]);
      fcl::DistanceResultd result;
      const auto origin = fcl::Transform3d::Identity();
      adaptive_bvh::distance(&model, origin, &tool, origin, fcl::DistanceRequestd(), result);
    };
    compare(
        "x " + std::to_string(resolution * resolution), size(all), rounds, poke.frames.size(),
        [&](std::size_t i) { all.update(poke.frames[i]); }, [&](std::size_t i) { ask(all, i); },
        [&](std::size_t i) { some.update(poke.indices[i], poke.to[i]); },
        [&](std::size_t i) { ask(some, i); });
  }
  heading("local poke, sheet, mesh", "triangle", "update of all", "of moved vertices");
  for (int resolution : kPokes) {
    const Poke poke(resolution);
    Mesh all(poke.scenario.first.mesh()), some = all;
    compare(
        "x " + std::to_string(resolution * resolution), size(all), rounds, poke.frames.size(),
        [&](std::size_t i) { all.update(poke.frames[i]); }, nothing,
        [&](std::size_t i) { some.update(poke.indices[i], poke.to[i]); }, nothing);
  }
}

void threads(int rounds, int count) {
  const std::string several = std::to_string(count) + " threads";
  heading("threads, helmet, model", "node", "one", several.c_str());
  const auto compareThreads = [&](const std::string& what, auto one,
                                  const std::vector<Positions>& frames) {
    auto many = one;
    many.setThreads(count);
    compare(
        what, size(one), rounds, frames.size(), [&](std::size_t i) { one.update(frames[i]); },
        nothing, [&](std::size_t i) { many.update(frames[i]); }, nothing);
  };
  constexpr int kResolutions[] = {9, 12, 20};
  for (int resolution : kResolutions) {
    const scenarios::Body body = scenarios::helmet(resolution);
    for (const auto criterion :
         {adaptive_bvh::FitnessCriterion::RefitNone, adaptive_bvh::FitnessCriterion::A})
      compareThreads(
          std::to_string(body.triangles().size()) + " triangles, " +
              (criterion == adaptive_bvh::FitnessCriterion::A ? "refits by test A" : "no refits"),
          modelOf(body, criterion), framesOf(body));
  }
  heading("threads, helmet, mesh", "triangle", "one", several.c_str());
  for (int resolution : kResolutions) {
    const scenarios::Body body = scenarios::helmet(resolution);
    compareThreads(std::to_string(body.triangles().size()) + " triangles", Mesh(body.mesh()),
                   framesOf(body));
  }
}

}  // namespace

int main(int argc, char** argv) {
  int rounds = 9, largest = 16, thread_count = 2;
  CLI::App app("Updates alone, against a floor, of a few vertices, on threads. Prints markdown.");
  app.add_option("--rounds", rounds, "Tables show medians of so many")->check(CLI::Range(1, 1000));
  app.add_option("--largest", largest, "Resolution up to which floors are measured");
  app.add_option("--threads", thread_count, "To compare with one")->check(CLI::Range(2, 64));
  CLI11_PARSE(app, argc, argv);
  floors(rounds, largest);
  meshes(rounds, largest);
  partial(rounds);
  threads(rounds, thread_count);
  bytes(rounds, largest);
}
