// ContactSet beside new queries, in turns in one process: how much of their time an update takes,
// on average over a run, updates of the meshes excluded. Ends with status 1 when the pairs differ.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/contact_set.h"
#include "stopwatch.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include <filesystem>

#include "adaptive_bvh/mesh_io.h"
#endif

namespace {

using adaptive_bvh::ContactElements;
using adaptive_bvh::ContactSet;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::NumberedPairs;
using adaptive_bvh_bench::milliseconds;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;
using Positions = std::vector<Point>;
using Request = adaptive_bvh::ContactSetRequest;
using Pairs = std::vector<FeaturePair>;

bool failed = false;
/// Rows to print: those whose titles have this text.
std::string chosen_rows;

/// A grid bent by place(u, v) for u and v in [0, 1].
template <typename Place>
Mesh grid(int columns, int rows, const Place& place) {
  Mesh mesh;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      mesh.vertices.push_back(place(double(i) / columns, double(j) / rows));
  const auto at = [&](int i, int j) { return std::size_t(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return mesh;
}
double meanEdge(const Mesh& mesh) {
  double sum = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    sum += (mesh.vertices[t[0]] - mesh.vertices[t[1]]).norm();
  return sum / double(mesh.triangles.size());
}

Pairs living(const NumberedPairs& list) {
  Pairs pairs;
  for (const FeaturePair& pair : list.pairs)
    if (pair.first != NumberedPairs::kNone) pairs.push_back(pair);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}
bool areSame(const NumberedPairs& list, Pairs found) {
  std::sort(found.begin(), found.end());
  return living(list) == found;
}

/// The results of a new query.
struct Found {
  adaptive_bvh::TrianglePairs triangles;
  FeaturePairs features;
};

void compare(const ContactSet& set, const Request& request,
             const adaptive_bvh::TrianglePairs& triangles, const FeaturePairs& features) {
  const bool same =
      request.elements == ContactElements::Triangles
          ? areSame(set.triangles(), triangles.triangles)
          : areSame(set.features(FeatureKind::VertexFace), features.vertex_face) &&
                areSame(set.features(FeatureKind::FaceVertex), features.face_vertex) &&
                areSame(set.features(FeatureKind::EdgeEdge), features.edge_edge);
  if (same) return;
  std::printf("WRONG: the set differs from that of a new query\n");
  failed = true;
}

bool isChosen(const std::string& row) { return row.find(chosen_rows) != std::string::npos; }

void printHead(const std::string& title) {
  std::printf(
      "\n%s, pairs within half an edge\n"
      "| | pairs | changed a step | candidates of each | tested, %% | searches a step | "
      "first update, ms | query, ms | update, ms | ratio | |\n"
      "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |\n",
      title.c_str());
}

/// What a run has measured; sums over its steps.
struct Row {
  double first = 0, of_query = 0, of_set = 0;  ///< times
  std::size_t changed = 0, tested = 0, candidates = 0, searches = 0;

  void count(const ContactSet& set) {
    for (const NumberedPairs* list :
         {&set.triangles(), &set.features(FeatureKind::VertexFace),
          &set.features(FeatureKind::FaceVertex), &set.features(FeatureKind::EdgeEdge)})
      changed += list->added.size() + list->removed.size();
    tested += set.work().tested;
    candidates += set.work().candidates;
  }
  void print(const std::string& name, const ContactSet& set, int steps, double allowed) const {
    const double n = steps, all = double(std::max<std::size_t>(1, candidates)),
                 pairs = double(std::max<std::size_t>(1, set.size()));
    std::printf("| %s | %zu | %.0f | %.2f | %.0f | %.2f | %.3g | %.3g | %.3g | %.3f | %s |\n",
                name.c_str(), set.size(), double(changed) / n, double(candidates) / n / pairs,
                100 * double(tested) / all, double(searches) / n, first, of_query / n, of_set / n,
                of_set / of_query, of_set <= allowed * of_query ? "" : "more than allowed");
    std::fflush(stdout);
  }
};

/// Runs steps: move(i) changes the meshes, query() finds all pairs anew, compare() compares. Prints
/// a row with the ratio of the average times.
void run(const std::string& name, ContactSet& set, int steps, double allowed,
         const std::function<void(int)>& move, const std::function<void()>& query,
         const std::function<void()>& compare_both) {
  Row row;
  const auto update = [&] { set.update(); };
  row.first = milliseconds(update);
  const std::size_t searches = set.work().searches;
  for (int i = 1; i <= steps; ++i) {
    move(i);
    if (i % 2) row.of_query += milliseconds(query);
    row.of_set += milliseconds(update);
    if (i % 2 == 0) row.of_query += milliseconds(query);
    if (i % 7 == 1 || i == steps) compare_both();
    row.count(set);
  }
  row.searches = set.work().searches - searches;
  row.print(name, set, steps, allowed);
}

/// One mesh with itself, along straight lines between two frames.
class SelfRuns {
 public:
  SelfRuns(Mesh from, Positions to) : from_(std::move(from)), to_(std::move(to)) {}

  void all(int most_steps) {
    for (const ContactElements elements : {ContactElements::Triangles, ContactElements::Features}) {
      const std::string what = elements == ContactElements::Triangles ? "triangles" : "features";
      for (const int parts : {500, 50})
        frames(what + ", frames in " + std::to_string(parts) + " parts", elements, parts,
               std::min(parts, most_steps), stepOf(parts) <= 0.02 ? 0.35 : 1.1);
      whole(what + ", steps of an edge", elements, std::min(20, most_steps));
      for (const double by : {0.02, 0.5})
        poke(what + ", 1 % moved by " + std::to_string(by).substr(0, 4) + " edges", elements, by,
             most_steps);
      still(what + ", nothing moves", elements);
    }
  }

 private:
  /// Largest step of a vertex, in edges.
  double stepOf(int parts) const {
    double most = 0;
    for (std::size_t v = 0; v < to_.size(); ++v)
      most = std::max(most, (to_[v] - from_.vertices[v]).norm());
    return most / parts / edge_;
  }
  Request requestOf(ContactElements elements) const {
    Request request;
    request.distance = edge_ / 2;
    request.elements = elements;
    return request;
  }
  void run(const std::string& name, ContactElements elements, int steps, double allowed,
           const std::function<void(DeformableMesh&, int)>& move) {
    if (!isChosen(name)) return;
    DeformableMesh mesh(from_);
    const Request request = requestOf(elements);
    ContactSet set(mesh, request);
    Found found;
    ::run(
        name, set, steps, allowed, [&](int i) { move(mesh, i); },
        [&] { query(mesh, elements, found); },
        [&] { compare(set, request, found.triangles, found.features); });
  }
  void query(const DeformableMesh& mesh, ContactElements elements, Found& found) const {
    const Request request = requestOf(elements);
    if (elements == ContactElements::Features)
      return selfFeaturePairsWithin(mesh, request.distance, found.features), void();
    adaptive_bvh::ProximityRequest of;
    of.distance = request.distance;
    selfPairsWithin(mesh, of, found.triangles);
  }

  void frames(const std::string& name, ContactElements elements, int parts, int steps,
              double allowed) {
    run(name, elements, steps, allowed, [&](DeformableMesh& mesh, int i) {
      Positions now = from_.vertices;
      for (std::size_t v = 0; v < now.size(); ++v)
        now[v] += (to_[v] - now[v]) * (double(i) / parts);
      mesh.update(now);
    });
  }
  /// All vertices move by an edge, in a direction that varies over the mesh.
  void whole(const std::string& name, ContactElements elements, int steps) {
    run(name, elements, steps, 1.1, [&](DeformableMesh& mesh, int i) {
      Positions now = from_.vertices;
      for (Point& p : now)
        p += edge_ * double(i % 4) *
             Point(std::sin(3 * p[1] / edge_ / 20), std::cos(2 * p[2] / edge_ / 20), 0.3);
      mesh.update(now);
    });
  }
  /// A hundredth of the vertices, around one of them, which changes.
  void poke(const std::string& name, ContactElements elements, double by, int steps) {
    std::vector<unsigned> near;
    Positions to;
    run(name, elements, steps, 0.1, [&](DeformableMesh& mesh, int i) {
      if (i % 10 == 1) {
        near.resize(from_.vertices.size());
        for (unsigned v = 0; v < near.size(); ++v) near[v] = v;
        const Point centre = from_.vertices[std::size_t(i) * 7919 % near.size()];
        std::nth_element(near.begin(), near.begin() + std::ptrdiff_t(near.size() / 100), near.end(),
                         [&](unsigned a, unsigned b) {
                           return (from_.vertices[a] - centre).squaredNorm() <
                                  (from_.vertices[b] - centre).squaredNorm();
                         });
        near.resize(near.size() / 100);
      }
      to.clear();
      for (const unsigned v : near)
        to.push_back(from_.vertices[v] + by * edge_ * double(i % 10) * Point(0.5, 0.7, 0.5));
      mesh.update(near, to);
    });
  }
  void still(const std::string& name, ContactElements elements) {
    constexpr double kMost = 0.002;  // ms
    constexpr int kCalls = 10000;
    if (!isChosen(name)) return;
    const DeformableMesh mesh(from_);
    ContactSet set(mesh, requestOf(elements));
    Found found;
    Row row;
    row.first = milliseconds([&] { set.update(); });
    row.of_query = milliseconds([&] { query(mesh, elements, found); });
    row.of_set = milliseconds([&] {
                   for (int i = 0; i < kCalls; ++i) set.update();
                 }) /
                 kCalls;
    row.print(name, set, 1, kMost / row.of_query);
  }

  const Mesh from_;
  const Positions to_;
  const double edge_ = meanEdge(from_);
};

/// Blobs in a box that move and deform: all of them a little, or one in a hundred.
void crowd(int count, int steps) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const Mesh blob = grid(30, 30, [](double u, double v) -> Point {
    const double polar = M_PI * (0.02 + 0.96 * v), angle = 2 * M_PI * u;
    const double radius = 1 + 0.2 * std::sin(3 * angle) * std::sin(polar);
    return radius * Point(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                          std::cos(polar));
  });
  const double edge = meanEdge(blob), side = std::cbrt(double(count)) * 2.4;
  for (const double share : {1., 0.01})
    for (const double speed : {0.02, 0.2}) {
      const int moving = std::max(1, int(share * count));
      const std::string name = std::to_string(moving) + " of " + std::to_string(count) +
                               " blobs move by " + std::to_string(speed).substr(0, 4) + " edges";
      if (!isChosen(name)) continue;
      std::vector<std::shared_ptr<DeformableMesh>> meshes;
      adaptive_bvh::Scene scene;
      std::vector<fcl::Transform3d> poses;
      for (int i = 0; i < count; ++i) {
        meshes.push_back(std::make_shared<DeformableMesh>(blob));
        fcl::Transform3d tf = fcl::Transform3d::Identity();
        tf.translation() = Point(any(random), any(random), any(random)) * side / 2;
        poses.push_back(tf);
        scene.add(meshes.back(), tf);
      }
      scene.update();
      Request request;
      request.distance = edge / 2;
      ContactSet set(scene, request);
      adaptive_bvh::SceneTrianglePairs found;
      adaptive_bvh::ProximityRequest of;
      of.distance = request.distance;
      run(
          name, set, steps,
          share < 1      ? 0.1
          : speed > 0.02 ? 1.1
                         : 0.35,
          [&](int) {
            for (int i = 0; i < moving; ++i) {
              poses[std::size_t(i)].translation() +=
                  speed * edge * Point(any(random), any(random), any(random)) / 2;
              scene.setTransform(adaptive_bvh::BodyId(i), poses[std::size_t(i)]);
              Positions now = meshes[std::size_t(i)]->vertices();
              for (Point& p : now) p *= 1 + 0.1 * speed * edge * any(random);
              meshes[std::size_t(i)]->update(now);
            }
            scene.update();
          },
          [&] { scene.pairsWithin(of, found); },
          [&] {
            if (found.found.size() == set.size() && areSame(set.triangles(), found.found.triangles))
              return;
            std::printf("WRONG: the set differs from that of a new query of the scene\n");
            failed = true;
          });
    }
}

/// A cloth of folds, whose folds move.
void folds(int cells, int steps) {
  printHead("A cloth with folds");
  const auto fold = [](double u, double v, double time) -> Point {
    return {u - 0.35 * u * std::sin(9 * u + time), v,
            0.06 * std::sin(40 * u + time) + 0.02 * std::sin(17 * v - time)};
  };
  const Mesh cloth = grid(cells, cells, [&](double u, double v) { return fold(u, v, 0); });
  SelfRuns(cloth, grid(cells, cells, [&](double u, double v) { return fold(u, v, 0.1); }).vertices)
      .all(steps);
}

#ifdef ADAPTIVE_BVH_HAS_MESH_IO
/// Between two frames of a simulation.
void frames(const std::string& folder, const std::string& from, const std::string& to, int steps) {
  const std::string start = folder + "/" + from + ".ply", end = folder + "/" + to + ".ply";
  if (!std::filesystem::exists(start)) return;
  printHead(from);
  adaptive_bvh::MeshLoadOptions keep;
  keep.weld = false;  // both frames pair their vertices by number
  SelfRuns(adaptive_bvh::loadMesh(start, keep), adaptive_bvh::loadMesh(end, keep).vertices)
      .all(steps);
}
#endif

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("ContactSet: its time as a share of that of new queries");
  int steps = 50;
  bool is_small = false;
  std::string data;
  app.add_option("--steps", steps, "Most steps of a run")->check(CLI::Range(4, 1000));
  app.add_option("--data", data, "Folder with the frames of simulations, see docs/performance.md");
  app.add_option("--row", chosen_rows, "Only rows whose titles have this text");
  std::vector<std::string> bodies;
  app.add_option("--body", bodies, "Only these bodies")
      ->check(CLI::IsMember({"folds", "crowd", "cloth_funnel_227", "armadillo_rollers_326"}));
  app.add_flag("--small", is_small, "Small bodies, to see that it works");
  CLI11_PARSE(app, argc, argv);
  const auto takes = [&](const char* body) {
    return bodies.empty() || std::find(bodies.begin(), bodies.end(), body) != bodies.end();
  };
  if (takes("folds")) folds(is_small ? 20 : 90, steps);
  if (takes("crowd")) {
    printHead("A crowd");
    crowd(is_small ? 30 : 300, std::min(steps, 24));
  }
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  if (!is_small && takes("cloth_funnel_227"))
    frames(data, "cloth_funnel_227", "cloth_funnel_228", steps);
  if (!is_small && takes("armadillo_rollers_326"))
    frames(data, "armadillo_rollers_326", "armadillo_rollers_327", steps);
#endif
  return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
