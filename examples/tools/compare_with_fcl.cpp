// Two deforming meshes and their exact distance in every frame, five ways side by side:
//   fcl       fcl::BVHModel, refitted whole and soundly (top-down), fcl::distance
//   drop-in   the same calls on adaptive_bvh::AdaptiveBVHModel, fcl::distance
//   recorded  the same with adaptive_bvh::distance, which reports to the update where the query was
//   mesh      adaptive_bvh::DeformableMesh, adaptive_bvh::distance
//   coherent  the same with adaptive_bvh::CoherentDistance, which follows the pair over frames
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/query.h"
#include "clock.h"
#include "mesh_options.h"
#include "motion.h"
#include "run_page.h"

namespace {

using tools::Clock;
using tools::Motion;
using tools::Positions;
using Mesh = adaptive_bvh::TriangleMesh;

struct Options {
  std::string mesh_a, mesh_b, to, csv, page, volume = "rss";
  int frames = 200;
  adaptive_bvh::MeshLoadOptions load;
};

struct Cost {
  double update = 0, query = 0, distance = 0;
  int refitted = 0;
  double total() const { return update + query; }
  void operator+=(const Cost& c) {
    update += c.update;
    query += c.query;
    refitted += c.refitted;
  }
};

/// A frame of any pair of bodies: `move` takes them to their positions, `query` fills in a result.
template <typename Move, typename Query>
Cost costOf(Move&& move, Query&& query) {
  fcl::DistanceResultd result;
  Cost cost;
  Clock clock;
  move();
  cost.update = clock.milliseconds();
  query(fcl::DistanceRequestd(), result);
  cost.query = clock.milliseconds();
  cost.distance = result.min_distance;
  return cost;
}

/// A pair of models of one kind, taken through a frame by FCL's own calls.
template <typename Model, typename BV>
struct ModelPair {
  Model a, b;
  bool recorded = false;

  ModelPair(const Mesh& mesh_a, const Mesh& mesh_b) {
    fillModel(mesh_a, a);
    fillModel(mesh_b, b);
  }

  static void move(Model& model, const Positions& positions) {
    model.beginReplaceModel();
    model.replaceSubModel(positions);
    model.endReplaceModel(true, false);  // refit, top-down: FCL's bottom-up refit is wrong
  }

  Cost frame(const Positions& pa, const Positions& pb) {
    Cost cost = costOf(
        [&] {
          move(a, pa);
          move(b, pb);
        },
        [&](const fcl::DistanceRequestd& request, fcl::DistanceResultd& result) {
          const auto identity = fcl::Transform3d::Identity();
          const fcl::CollisionGeometryd *ga = &a, *gb = &b;
          if (recorded)
            adaptive_bvh::distance(ga, identity, gb, identity, request, result);
          else
            fcl::distance(ga, identity, gb, identity, request, result);
        });
    cost.refitted = refitted(a) + refitted(b);
    return cost;
  }

  static int refitted(const fcl::BVHModel<BV>& model) { return model.getNumBVs(); }
  static int refitted(const adaptive_bvh::AdaptiveBVHModel<BV>& model) {
    return model.lastUpdate().refitted();
  }
};

/// A pair of DeformableMeshes.
struct MeshPair {
  adaptive_bvh::DeformableMesh a, b;
  adaptive_bvh::CoherentDistance followed{a, b};

  MeshPair(const Mesh& mesh_a, const Mesh& mesh_b) : a(mesh_a), b(mesh_b) {}

  Cost frame(const Positions& pa, const Positions& pb, bool follow) {
    return costOf(
        [&] {
          a.update(pa);
          b.update(pb);
        },
        [&](const fcl::DistanceRequestd& request, fcl::DistanceResultd& result) {
          const auto identity = fcl::Transform3d::Identity();
          if (follow)
            followed.distance(identity, identity, request, result);
          else
            adaptive_bvh::distance(&a, identity, &b, identity, request, result);
        });
  }
};

/// Of meshes without the nodes, which they do not have.
void printRow(const char* name, const Cost& sum, const Cost& fcl, int frames) {
  std::printf("  %-9s %9.3f %9.3f %9.3f   %6.2fx", name, sum.update / frames, sum.query / frames,
              sum.total() / frames, fcl.total() / sum.total());
  if (sum.refitted > 0) std::printf("   %10.1f", double(sum.refitted) / frames);
  std::printf("\n");
}

/// Throws unless the triangles are those of the mesh, so that vertices pair by number.
void checkTopology(const Mesh& mesh, const Mesh& pose, const std::string& name) {
  bool same = pose.vertices.size() == mesh.vertices.size() &&
              pose.triangles.size() == mesh.triangles.size();
  for (std::size_t t = 0; same && t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) same &= mesh.triangles[t][k] == pose.triangles[t][k];
  if (!same) throw std::runtime_error("'" + name + "' has another topology than the mesh");
}

/// The two meshes and where A moves to, if anywhere.
struct Input {
  Mesh a, b;
  Positions target;

  explicit Input(const Options& options) {
    const std::string data = ADAPTIVE_BVH_EXAMPLE_DATA;
    adaptive_bvh::MeshLoadOptions keep_vertices = options.load;
    keep_vertices.weld = options.to.empty();
    const bool own_mesh = !options.mesh_a.empty(), own_floor = !options.mesh_b.empty();
    a = adaptive_bvh::loadMesh(own_mesh ? options.mesh_a : data + "/helmet.obj", keep_vertices);
    b = adaptive_bvh::loadMesh(own_floor ? options.mesh_b : data + "/plate.ply", options.load);
    if (own_mesh && !own_floor) tools::placeBelow(b.vertices, a.vertices);
    if (options.to.empty()) return;
    const Mesh pose = adaptive_bvh::loadMesh(options.to, keep_vertices);
    checkTopology(a, pose, options.to);
    target = pose.vertices;
  }
};

/// This library's.
constexpr std::array<const char*, 4> kWays = {"drop-in", "recorded", "mesh", "coherent"};
using Costs = std::array<Cost, kWays.size()>;

/// A row per frame; nothing without a path.
class Csv {
 public:
  explicit Csv(const std::string& path) {
    if (path.empty()) return;
    out_.open(path);
    if (!out_) throw std::runtime_error("cannot write '" + path + "'");
    out_ << "frame,distance,disagreement,fcl_update_ms,fcl_query_ms";
    for (std::string way : kWays) {
      std::replace(way.begin(), way.end(), '-', '_');
      out_ << ',' << way << "_update_ms," << way << "_query_ms," << way << "_refitted";
    }
    out_ << '\n';
  }

  void add(int frame, double disagreement, const Cost& fcl, const Costs& ours) {
    if (!out_.is_open()) return;
    out_ << frame << ',' << fcl.distance << ',' << disagreement << ',' << fcl.update << ','
         << fcl.query;
    for (const Cost& c : ours) out_ << ',' << c.update << ',' << c.query << ',' << c.refitted;
    out_ << '\n';
  }

 private:
  std::ofstream out_;
};

/// On a terminal in every frame, on one line.
void printProgress(int frame, int frames, double distance, double speed_up) {
  const bool terminal = isatty(STDOUT_FILENO), last = frame == frames;
  if (terminal || last)
    std::printf("%sframe %d/%d   distance %.6f   speed-up %.2fx   %s", terminal ? "\r" : "", frame,
                frames, distance, speed_up, last ? "\n" : "");
  std::fflush(stdout);
}

template <typename BV>
void run(const Options& options) {
  using Plain = ModelPair<fcl::BVHModel<BV>, BV>;
  using Adaptive = ModelPair<adaptive_bvh::AdaptiveBVHModel<BV>, BV>;
  const Input input(options);
  const auto& [a, b, target] = input;
  Motion motion_a(a.vertices, target.empty() ? Motion::Squeeze : Motion::Interpolate, target);
  Motion motion_b(b.vertices, Motion::Wave);
  std::printf("A: %zu vertices, %zu triangles   B: %zu vertices, %zu triangles   %d frames\n",
              a.vertices.size(), a.triangles.size(), b.vertices.size(), b.triangles.size(),
              options.frames);

  Plain plain(a, b);
  Adaptive drop_in(a, b), recorded(a, b);
  recorded.recorded = true;
  MeshPair meshes(a, b), coherent(a, b);
  Csv csv(options.csv);

  Cost sum_fcl;
  Costs sums;
  double worst = 0, nearest = std::numeric_limits<double>::max();
  for (int frame = 1; frame <= options.frames; ++frame) {
    const double t = double(frame) / options.frames;
    const Positions &pa = motion_a.at(t), &pb = motion_b.at(t);
    const Cost fcl = plain.frame(pa, pb);
    const Costs ours = {drop_in.frame(pa, pb), recorded.frame(pa, pb), meshes.frame(pa, pb, false),
                        coherent.frame(pa, pb, true)};
    sum_fcl += fcl;
    double disagreement = 0;
    for (std::size_t way = 0; way < ours.size(); ++way) {
      sums[way] += ours[way];
      disagreement = std::max(disagreement, std::abs(ours[way].distance - fcl.distance));
    }
    worst = std::max(worst, disagreement);
    nearest = std::min(nearest, fcl.distance);
    csv.add(frame, disagreement, fcl, ours);
    printProgress(frame, options.frames, ours.back().distance,
                  sum_fcl.total() / sums.back().total());
  }

  std::printf("smallest distance %.6f   largest disagreement with FCL %.3g\n", nearest, worst);
  std::printf("  per frame  update ms  query ms  total ms  speed-up  nodes refitted (of %d)\n",
              plain.a.getNumBVs() + plain.b.getNumBVs());
  printRow("fcl", sum_fcl, sum_fcl, options.frames);
  for (std::size_t way = 0; way < kWays.size(); ++way)
    printRow(kWays[way], sums[way], sum_fcl, options.frames);
  if (!options.page.empty())
    tools::writePage<BV>({a, b, motion_a, motion_b, options.frames}, options.page);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Exact distance between two deforming meshes: FCL's refit against adaptive_bvh.");
  app.add_option("MESH_A", options.mesh_a, "Mesh file (default: the helmet)");
  app.add_option("MESH_B", options.mesh_b, "Mesh file (default: a plate below MESH_A)");
  app.add_option("--to", options.to, "A second pose of MESH_A: go there and back");
  app.add_option("--frames", options.frames, "Number of frames")->check(CLI::Range(1, 1000000));
  app.add_option("--volume", options.volume, "Bounding volumes of the models: rss or obbrss")
      ->check(CLI::IsMember({"rss", "obbrss"}));
  app.add_option("--csv", options.csv, "Write a row per frame to this file");
  app.add_option("--page", options.page, "Then record the run as a page that plays it")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  tools::addMeshOptions(app, options.load);
  try {
    app.parse(argc, argv);
    if (options.volume == "obbrss")
      run<fcl::OBBRSSd>(options);
    else
      run<fcl::RSSd>(options);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
  } catch (const std::exception& error) {
    std::cerr << "compare_with_fcl: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
