// Two deforming meshes and their exact distance in every frame, three ways side by side:
//   fcl       fcl::BVHModel, refitted whole and soundly (top-down), fcl::distance
//   drop-in   the same calls on adaptive_bvh::AdaptiveBVHModel, fcl::distance
//   recorded  the same with adaptive_bvh::distance, which tells the update where the query was
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/query.h"

namespace {

using Point = fcl::Vector3d;
using Mesh = adaptive_bvh::TriangleMesh<double>;
using Positions = std::vector<Point>;
using Plain = fcl::BVHModel<fcl::RSSd>;
using Adaptive = adaptive_bvh::AdaptiveBVHModeld;

struct Options {
  std::string mesh_a, mesh_b, to, csv;
  int frames = 200;
};

Eigen::AlignedBox3d boxOf(const Positions& points) {
  Eigen::AlignedBox3d box;
  for (const Point& p : points) box.extend(p);
  return box;
}

/// One body: where its vertices are at time t in [0, 1]. The motion ends where it began.
class Motion {
 public:
  enum Style { Squeeze, Wave, Interpolate };

  Motion(Positions rest, Style style, Positions target = {})
      : rest_(std::move(rest)), target_(std::move(target)), style_(style), now_(rest_) {
    const Eigen::AlignedBox3d box = boxOf(rest_);
    center_ = box.center();
    size_ = box.sizes().maxCoeff() / 2;
    box.sizes().minCoeff(&thin_axis_);
  }

  const Positions& rest() const { return rest_; }
  const Positions& at(double t) {
    for (std::size_t v = 0; v < rest_.size(); ++v) now_[v] = place(v, 2 * M_PI * t);
    return now_;
  }

 private:
  Point place(std::size_t v, double phase) const {
    const double there = (1 - std::cos(phase)) / 2;  // 0 at the ends, 1 in the middle
    if (style_ == Interpolate) return (1 - there) * rest_[v] + there * target_[v];
    Point q = (rest_[v] - center_) / size_;
    if (style_ == Squeeze) {  // flattened from one side, bulging to the other, with a dent
      const double depth = std::sin(phase);
      const double dent = 0.12 * there * std::exp(-4 * (q - Point(0.4, 0, 0.5)).squaredNorm());
      q = Point(q[0] * (1 - 0.2 * depth), q[1] * (1 + 0.12 * depth), q[2] * (1 - 0.1 * depth));
      q *= 1 - dent;
    } else {  // a wave across the thin side
      const int along = (thin_axis_ + 1) % 3, across = (thin_axis_ + 2) % 3;
      q[thin_axis_] += 0.1 * (std::sin(3 * q[along] + 2 * phase) - std::sin(3 * q[along])) *
                       std::cos(1.5 * q[across]);
    }
    return center_ + size_ * q;
  }

  Positions rest_, target_;
  Style style_;
  Positions now_;
  Point center_;
  double size_ = 1;
  int thin_axis_ = 0;
};

class Clock {
 public:
  double milliseconds() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
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

/// A pair of models of one kind, taken through a frame by FCL's own calls.
template <typename Model>
struct Pair {
  Model a, b;
  adaptive_bvh::CoherentDistanced* followed = nullptr;  // where a pair is followed over frames
  bool recorded = false;

  Pair(const Mesh& mesh_a, const Mesh& mesh_b) {
    fillModel(mesh_a, a);
    fillModel(mesh_b, b);
  }

  static void move(Model& model, const Positions& positions) {
    model.beginReplaceModel();
    model.replaceSubModel(positions);
    model.endReplaceModel(true, false);  // refit, top-down: FCL's bottom-up refit is wrong for RSS
  }

  Cost frame(const Positions& pa, const Positions& pb) {
    const auto identity = fcl::Transform3d::Identity();
    const fcl::CollisionGeometryd *ga = &a, *gb = &b;
    fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    Cost cost;
    Clock clock;
    move(a, pa);
    move(b, pb);
    cost.update = clock.milliseconds();
    if (followed)
      followed->distance(identity, identity, request, result);
    else if (recorded)
      adaptive_bvh::distance(ga, identity, gb, identity, request, result);
    else
      fcl::distance(ga, identity, gb, identity, request, result);
    cost.query = clock.milliseconds();
    cost.distance = result.min_distance;
    cost.refitted = refitted(a) + refitted(b);
    return cost;
  }

  static int refitted(const Plain& model) { return model.getNumBVs(); }
  static int refitted(const Adaptive& model) { return model.lastUpdate().refitted(); }
};

/// The default plate, scaled and placed below a mesh of any size.
void placeBelow(Positions& plate, const Positions& mesh) {
  const Eigen::AlignedBox3d from = boxOf(plate), above = boxOf(mesh);
  const double scale = above.sizes().maxCoeff() / from.sizes().maxCoeff();
  const Point target(above.center()[0], above.center()[1],
                     above.min()[2] - 0.15 * above.sizes().maxCoeff());
  for (Point& p : plate) p = target + scale * (p - from.center());
}

void printRow(const char* name, const Cost& sum, const Cost& fcl, int frames) {
  std::printf("  %-9s %9.3f %9.3f %9.3f   %6.2fx   %10.1f\n", name, sum.update / frames,
              sum.query / frames, sum.total() / frames, fcl.total() / sum.total(),
              double(sum.refitted) / frames);
}

void run(const Options& options) {
  const std::string data = ADAPTIVE_BVH_EXAMPLE_DATA;
  adaptive_bvh::MeshLoadOptions keep_vertices;
  keep_vertices.weld = options.to.empty();  // two poses of one mesh pair their vertices by number
  const bool own_mesh = !options.mesh_a.empty(), own_floor = !options.mesh_b.empty();
  Mesh a = adaptive_bvh::loadMesh<double>(own_mesh ? options.mesh_a : data + "/helmet.obj",
                                          keep_vertices);
  Mesh b = adaptive_bvh::loadMesh<double>(own_floor ? options.mesh_b : data + "/plate.ply");
  if (own_mesh && !own_floor) placeBelow(b.vertices, a.vertices);

  Positions target;
  if (!options.to.empty()) {
    Mesh pose = adaptive_bvh::loadMesh<double>(options.to, keep_vertices);
    bool same =
        pose.vertices.size() == a.vertices.size() && pose.triangles.size() == a.triangles.size();
    for (std::size_t t = 0; same && t < a.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) same &= a.triangles[t][k] == pose.triangles[t][k];
    if (!same) throw std::runtime_error("'" + options.to + "' has another topology than the mesh");
    target = pose.vertices;
  }
  Motion motion_a(a.vertices, target.empty() ? Motion::Squeeze : Motion::Interpolate, target);
  Motion motion_b(b.vertices, Motion::Wave);
  std::printf("A: %zu vertices, %zu triangles   B: %zu vertices, %zu triangles   %d frames\n",
              a.vertices.size(), a.triangles.size(), b.vertices.size(), b.triangles.size(),
              options.frames);

  Pair<Plain> plain(a, b);
  Pair<Adaptive> drop_in(a, b), recorded(a, b), coherent(a, b);
  recorded.recorded = true;
  adaptive_bvh::CoherentDistanced followed(coherent.a, coherent.b);
  coherent.followed = &followed;
  std::ofstream csv;
  if (!options.csv.empty()) {
    csv.open(options.csv);
    if (!csv) throw std::runtime_error("cannot write '" + options.csv + "'");
    csv << "frame,distance,disagreement,fcl_update_ms,fcl_query_ms,drop_in_update_ms,"
           "drop_in_query_ms,drop_in_refitted,recorded_update_ms,recorded_query_ms,"
           "recorded_refitted,coherent_update_ms,coherent_query_ms,coherent_refitted\n";
  }

  Cost sum_fcl, sum_drop_in, sum_recorded, sum_coherent;
  double worst = 0, nearest = std::numeric_limits<double>::max();
  for (int frame = 1; frame <= options.frames; ++frame) {
    const double t = double(frame) / options.frames;
    const Positions &pa = motion_a.at(t), &pb = motion_b.at(t);
    const Cost f = plain.frame(pa, pb), d = drop_in.frame(pa, pb), r = recorded.frame(pa, pb),
               c = coherent.frame(pa, pb);
    sum_fcl += f;
    sum_drop_in += d;
    sum_recorded += r;
    sum_coherent += c;
    double disagreement = 0;
    for (const Cost* ours : {&d, &r, &c})
      disagreement = std::max(disagreement, std::abs(ours->distance - f.distance));
    worst = std::max(worst, disagreement);
    nearest = std::min(nearest, f.distance);
    if (csv.is_open())
      csv << frame << ',' << f.distance << ',' << disagreement << ',' << f.update << ',' << f.query
          << ',' << d.update << ',' << d.query << ',' << d.refitted << ',' << r.update << ','
          << r.query << ',' << r.refitted << ',' << c.update << ',' << c.query << ',' << c.refitted
          << '\n';
    const bool last = frame == options.frames;
    if (isatty(STDOUT_FILENO) || last)
      std::printf("%sframe %d/%d   distance %.6f   speed-up %.2fx   %s",
                  isatty(STDOUT_FILENO) ? "\r" : "", frame, options.frames, c.distance,
                  sum_fcl.total() / sum_coherent.total(), last ? "\n" : "");
    std::fflush(stdout);
  }

  std::printf("smallest distance %.6f   largest disagreement with FCL %.3g\n", nearest, worst);
  std::printf("  per frame  update ms  query ms  total ms  speed-up  nodes refitted (of %d)\n",
              plain.a.getNumBVs() + plain.b.getNumBVs());
  printRow("fcl", sum_fcl, sum_fcl, options.frames);
  printRow("drop-in", sum_drop_in, sum_fcl, options.frames);
  printRow("recorded", sum_recorded, sum_fcl, options.frames);
  printRow("coherent", sum_coherent, sum_fcl, options.frames);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Exact distance between two deforming meshes: FCL's refit against adaptive_bvh.");
  app.add_option("MESH_A", options.mesh_a, "Mesh file (default: the helmet)");
  app.add_option("MESH_B", options.mesh_b, "Mesh file (default: a plate below MESH_A)");
  app.add_option("--to", options.to, "A second pose of MESH_A: go there and back");
  app.add_option("--frames", options.frames, "Number of frames")->check(CLI::Range(1, 1000000));
  app.add_option("--csv", options.csv, "Write a row per frame to this file");
  try {
    app.parse(argc, argv);
    run(options);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
  } catch (const std::exception& error) {
    std::cerr << "01_deforming_distance: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
