// Records five runs as pages, and writes beside each what a browser must show of it, read from the
// meshes and models themselves: test/recording/page/run.sh compares. Prints what recording costs.
//   record_runs FOLDER
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>

#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <nlohmann/json.hpp>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/hierarchy.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/recording.h"
#include "scenarios.h"
#include "support/fcl_float.h"

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Depth of the volumes that are compared; deeper ones have not been recorded.
constexpr int kDepth = 3, kRecordedDepth = 6;

/// What is shown of a body without volumes: a few positions.
json expectedBody(const fcl::Vector3d* vertices, std::size_t count) {
  json body = {{"positions", json::array()}, {"volumes", 0}, {"refitted", 0}, {"allRefitted", 0}};
  for (std::size_t v = 0; v < count; v += 1 + count / 50) {
    const fcl::Vector3d p = vertices[v];
    body["positions"].push_back({v, p[0], p[1], p[2]});
  }
  return body;
}

json expectedBody(const adaptive_bvh::DeformableMesh& mesh) {
  return expectedBody(mesh.vertices().data(), mesh.vertices().size());
}
/// And the volumes at kDepth.
template <typename BV>
json expectedBody(const adaptive_bvh::AdaptiveBVHModel<BV>& model) {
  json body = expectedBody(model.vertices, static_cast<std::size_t>(model.num_vertices));
  const std::vector<int> nodes = nodesAtDepth(model, kDepth);
  body["volumes"] = nodes.size();
  const std::vector<int> refits = model.refittedNodes();
  body["refitted"] = std::count_if(nodes.begin(), nodes.end(), [&](int node) {
    return std::binary_search(refits.begin(), refits.end(), node);
  });
  body["allRefitted"] = refits.size();
  return body;
}

/// One run: a page, and what is expected of it.
class TestRun {
 public:
  TestRun(std::string path, const adaptive_bvh::RecordingOptions& options)
      : path_(std::move(path)), recording(options) {}

  /// `drawn`: arrows and segments by label. `visible`: bodies in the picture, unknown below 0.
  void frame(const adaptive_bvh::FrameResults& results, json bodies, json drawn = json::object(),
             int visible = -1) {
    const auto start = Clock::now();
    recording.frame(results);
    recording_ms_ += millisecondsSince(start);
    json frame = {{"bodies", std::move(bodies)}};
    if (results.distance) frame["distance"] = *results.distance;
    if (results.update_ms) frame["updateMs"] = *results.update_ms;
    if (results.query_ms) frame["queryMs"] = *results.query_ms;
    if (results.contact_count) frame["contacts"] = *results.contact_count;
    if (!results.vertex_distances.empty()) {
      const std::vector<double>& values = results.vertex_distances[0].values;
      frame["vertexDistance"] = *std::min_element(values.begin(), values.end());
    }
    if (!results.note.empty()) frame["note"] = results.note;
    frame["nearest"] = results.nearest_points.size();
    frame["coloured"] = 0;
    for (const adaptive_bvh::TrianglePatches& patches : results.patches)
      frame["coloured"] = frame["coloured"].get<std::size_t>() + patches.triangles.size();
    frame["drawn"] = std::move(drawn);
    frame["series"] = results.series;
    if (results.time) frame["time"] = *results.time;
    if (visible >= 0) frame["visible"] = visible;
    work_ms_ += results.update_ms.value_or(0) + results.query_ms.value_or(0);
    expected_["frames"].push_back(std::move(frame));
  }

  void write() {
    const auto start = Clock::now();
    recording.write(path_ + ".html");
    const double writing = millisecondsSince(start);
    expected_["depth"] = kDepth;
    std::ofstream out(path_ + ".json");
    out << expected_;
    if (!out.flush()) throw std::runtime_error("cannot write '" + path_ + ".json'");
    std::ifstream page(path_ + ".html", std::ios::ate | std::ios::binary);
    std::printf(
        "%s: %d frames, update and query %.1f ms, recording %.2f ms, writing "
        "%.1f ms, page %.2f MB\n",
        path_.c_str(), recording.frames(), work_ms_, recording_ms_, writing,
        double(page.tellg()) / 1e6);
  }

 private:
  std::string path_;
  json expected_;
  double recording_ms_ = 0, work_ms_ = 0;

 public:
  adaptive_bvh::Recording recording;
};

/// The query of a pair of bodies: their distance, by the boxes of meshes or FCL's volumes.
class MeshPair {
 public:
  explicit MeshPair(const scenarios::Scenario& scenario)
      : first(scenario.first.mesh()), second(scenario.second.mesh()) {}
  double distance(const fcl::DistanceRequestd& request, fcl::DistanceResultd& result) {
    const auto origin = fcl::Transform3d::Identity();
    return followed_.distance(origin, origin, request, result);
  }

  adaptive_bvh::DeformableMesh first, second;

 private:
  adaptive_bvh::CoherentDistance followed_{first, second};
};
class ModelPair {
 public:
  explicit ModelPair(const scenarios::Scenario& scenario) {
    fillModel(scenario.first.mesh(), first);
    fillModel(scenario.second.mesh(), second);
  }
  double distance(const fcl::DistanceRequestd& request, fcl::DistanceResultd& result) {
    const auto origin = fcl::Transform3d::Identity();
    return adaptive_bvh::distance(&first, origin, &second, origin, request, result);
  }

  adaptive_bvh::AdaptiveBVHModeld first, second;
};

/// A pair of bodies with their distance. The recorded bodies move every step.
template <typename Pair>
void recordDistances(const std::string& path, const std::string& title,
                     const scenarios::Scenario& scenario, int frames) {
  Pair pair(scenario);
  const auto origin = fcl::Transform3d::Identity();
  const fcl::DistanceRequestd request(true);

  adaptive_bvh::RecordingOptions options;
  options.title = title;
  options.volume_depth = kRecordedDepth;
  TestRun run(path, options);
  run.recording.add(pair.first, origin, scenario.first.name());
  run.recording.add(pair.second, origin, scenario.second.name());
  for (int frame = 1; frame <= frames; ++frame) {
    const int there = frame % (2 * scenario.frames());
    const int step = there <= scenario.frames() ? there : 2 * scenario.frames() - there;
    const auto p1 = scenario.first.positions(step), p2 = scenario.second.positions(step);
    auto start = Clock::now();
    pair.first.update(p1);
    pair.second.update(p2);
    const double update_ms = millisecondsSince(start);
    fcl::DistanceResultd result;
    start = Clock::now();
    pair.distance(request, result);
    adaptive_bvh::FrameResults results(result);
    results.addTimes(update_ms, millisecondsSince(start));
    run.frame(results, {expectedBody(pair.first), expectedBody(pair.second)});
  }
  run.write();
}

/// Boxes, contacts, distances of vertices, a body that is placed anew in every frame, and
/// one that is only looked at.
void recordContacts(const std::string& path) {
  const scenarios::Mesh plate = scenarios::plate(4).mesh(), helmet = scenarios::helmet(1).mesh();
  adaptive_bvh::AdaptiveOBBRSSModeld cloth, dome;
  fillModel(plate, cloth);
  fillModel(helmet, dome);
  const adaptive_bvh::DeformableMesh &cloth_mesh = cloth.mesh(), &dome_mesh = dome.mesh();
  const fcl::Transform3d origin = fcl::Transform3d::Identity();

  adaptive_bvh::RecordingOptions options;
  options.title = "Cloth & <dome>";
  options.unit = "mm";
  options.vertex_distance_range = std::array<double, 2>{0, 0.4};
  options.volume_depth = kRecordedDepth;
  TestRun run(path, options);
  const int of_cloth = run.recording.add(cloth, origin, "cloth");
  run.recording.add(dome, origin, "dome");
  fcl::Transform3d aside = fcl::Transform3d::Identity();
  aside.translation() = fcl::Vector3d(0, 0, -2);
  run.recording.add(plate, aside, "table");

  for (int frame = 0; frame < 24; ++frame) {
    const std::vector<fcl::Vector3d> moved = scenarios::plate(4).positions(frame);
    auto start = Clock::now();
    cloth.update(moved);
    const double update_ms = millisecondsSince(start);
    fcl::Transform3d fallen = origin;
    fallen.translation().z() = 1.2 - 0.08 * frame;
    run.recording.place(of_cloth, fallen);
    start = Clock::now();
    fcl::CollisionResultd contacts;
    adaptive_bvh::collide(&cloth_mesh, fallen, &dome_mesh, origin,
                          fcl::CollisionRequestd(10000, true), contacts);
    const double query_ms = millisecondsSince(start);
    std::vector<double> distances;
    adaptive_bvh::vertexDistances(cloth_mesh, fallen, dome_mesh, origin, 0.5, distances);
    adaptive_bvh::FrameResults results(contacts);
    results.addTimes(update_ms, query_ms).addVertexDistances(of_cloth, distances);
    results.addToSeries("energy, J", 2 - 0.05 * frame).time = 0.25 * frame;
    results.note = "Fallen by " + std::to_string(8 * frame) + " %";
    run.frame(results, {expectedBody(cloth), expectedBody(dome)});
  }
  run.write();
}

/// A scene: a sheet, shapes that come and go, arrows, segments and patches.
void recordScene(const std::string& path) {
  const scenarios::Mesh plate = scenarios::plate(2).mesh();
  adaptive_bvh::DeformableMesh sheet(plate);
  adaptive_bvh::Scene scene;
  const adaptive_bvh::BodyId of_sheet = scene.add(sheet);
  scene.add(std::make_shared<fcl::Halfspaced>(fcl::Vector3d::UnitZ(), -1.5));
  fcl::Transform3d aside = fcl::Transform3d::Identity();
  aside.translation() = fcl::Vector3d(0, 0, 0.8);
  const adaptive_bvh::BodyId ball = scene.add(std::make_shared<fcl::Sphered>(0.3), aside);

  adaptive_bvh::RecordingOptions options;
  options.title = "A scene";
  options.unit = "m";
  TestRun run(path, options);
  run.recording.follow(scene, [&](adaptive_bvh::BodyId id) {
    return id == of_sheet ? "sheet" : "shape " + std::to_string(id);
  });
  for (int frame = 0; frame < 8; ++frame) {
    sheet.update(scenarios::plate(2).positions(frame));
    if (frame == 4) scene.remove(ball);
    adaptive_bvh::FrameResults results;
    std::vector<fcl::Vector3d> up(sheet.vertices().size() / 9, fcl::Vector3d::UnitZ());
    std::vector<fcl::Vector3d> from(sheet.vertices().begin(),
                                    sheet.vertices().begin() + long(up.size()));
    results.addArrows("normal", from, up, 0.2);
    results.addSegments("pair", {{from[0], fcl::Vector3d(0, 0, 1)}});
    adaptive_bvh::TrianglePatches patches{run.recording.bodyOf(of_sheet), {}, {}};
    if (frame < 6) {  // then a contact without a triangle
      patches.triangles = {0, 1, 2, 3, 10, 11};
      patches.patches = {0, 0, 0, 0, 1, 1};
    }
    results.patches.push_back(patches);
    json bodies = {expectedBody(sheet)};
    run.frame(results, bodies, {{"normal", up.size()}, {"pair", 1}}, frame < 4 ? 3 : 2);
  }
  run.write();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: record_runs FOLDER\n");
    return 2;
  }
  const std::string folder = argv[1];
  const scenarios::Scenario small = scenarios::thesisScenarios().back();
  scenarios::Options finer;
  finer.resolution = 6;
  const scenarios::Scenario large = scenarios::thesisScenarios(finer).back();
  recordDistances<ModelPair>(folder + "/helmet", "A helmet above a plate", small, 40);
  recordDistances<ModelPair>(folder + "/large", "A fine helmet above a plate", large, 50);
  recordDistances<MeshPair>(folder + "/meshes", "Meshes without volumes", small, 40);
  recordContacts(folder + "/contacts");
  recordScene(folder + "/scene");
}
