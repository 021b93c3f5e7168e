// The parts of a step, by themselves: one volume test, one refit, one propagation; the build, the
// update and a copy of a DeformableMesh, and its smallest query. Items are nodes, vertices, fits or
// triangles, so items_per_second compares sizes.
#include <benchmark/benchmark.h>

#include <fcl/math/bv/RSS.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/hierarchy.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "bodies.h"
#include "scenarios.h"
#include "thesis/volumes/volume.h"

namespace {

using Mesh = adaptive_bvh::DeformableMesh;
using Model = adaptive_bvh::AdaptiveBVHModeld;
using V = adaptive_bvh::Volume<fcl::RSSd>;

Model helmetOf(int resolution) {
  Model model;
  fillModel(scenarios::helmet(resolution).mesh(), model);
  return model;
}

/// Two volumes of the helmet at one depth, at two poses.
void volumeTest(benchmark::State& state) {
  const Model model = helmetOf(4);
  const std::vector<int> nodes = nodesAtDepth(model, int(state.range(0)));
  fcl::Matrix3d R = Eigen::AngleAxisd(0.7, fcl::Vector3d(1, 2, 3).normalized()).matrix();
  const fcl::Vector3d T(0.3, 2, 0.5);
  std::size_t i = 0;
  for (auto _ : state) {
    const auto &a = model.getBV(nodes[i % nodes.size()]).bv,
               &b = model.getBV(nodes[(7 * i + 3) % nodes.size()]).bv;
    benchmark::DoNotOptimize(fcl::distance(R, T, a, b));
    ++i;
  }
}
BENCHMARK(volumeTest)->Arg(3)->Arg(8)->Arg(12);

void triangleTest(benchmark::State& state) {
  const scenarios::Mesh mesh = scenarios::helmet(4).mesh();
  std::size_t i = 0;
  scenarios::Point p, q;
  for (auto _ : state) {
    const auto &s = mesh.triangles[i % mesh.triangles.size()],
               &t = mesh.triangles[(7 * i + 3) % mesh.triangles.size()];
    const auto& v = mesh.vertices;
    benchmark::DoNotOptimize(fcl::detail::TriangleDistance<double>::triDistance(
        v[s[0]], v[s[1]], v[s[2]], v[t[0]], v[t[1]], v[t[2]], p, q));
    ++i;
  }
}
BENCHMARK(triangleTest);

/// A fit of 2^k triangles that lie together.
void refit(benchmark::State& state) {
  const Model model = helmetOf(4);
  const auto below = primitivesBelow(model, 0);
  const std::vector<unsigned> order(below.begin(), below.end());
  adaptive_bvh::MeshView<double> view;
  view.vertices = model.vertices;
  view.triangles = model.tri_indices;
  const auto count = std::size_t(state.range(0));
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(V::fit(view, &order[i], int(count)));
    i = i + 2 * count <= order.size() ? i + count : 0;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(refit)->RangeMultiplier(4)->Range(1, 4096);

/// An update by that criterion; its phase `seconds`.
template <typename Seconds>
void update(benchmark::State& state, adaptive_bvh::FitnessCriterion criterion, Seconds&& seconds) {
  Model model = helmetOf(int(state.range(0)));
  adaptive_bvh::RefitPolicy policy;
  policy.criterion = criterion;
  policy.propagation = static_cast<adaptive_bvh::Propagation>(state.range(1));
  model.setRefitPolicy(policy);
  const scenarios::Body body = scenarios::helmet(int(state.range(0)));
  const std::vector<scenarios::Point> steps[] = {body.positions(9), body.positions(10)};
  int i = 0;
  for (auto _ : state) state.SetIterationTime(seconds(model.update(steps[i++ % 2])));
}
const std::vector<std::vector<std::int64_t>> kUpdates = {{1, 4, 16}, {0, 1}};

/// Reading positions and measuring every displacement; items are vertices.
void displacement(benchmark::State& state) {
  update(state, adaptive_bvh::FitnessCriterion::RefitNone,
         [](const auto& report) { return report.displacement_seconds; });
  state.SetItemsProcessed(state.iterations() * helmetOf(int(state.range(0))).num_vertices);
}
BENCHMARK(displacement)->ArgsProduct(kUpdates)->UseManualTime();

/// The propagation; items are nodes.
void propagation(benchmark::State& state) {
  update(state, adaptive_bvh::FitnessCriterion::RefitNone,
         [](const auto& report) { return report.propagation_seconds; });
  state.SetItemsProcessed(state.iterations() * helmetOf(int(state.range(0))).getNumBVs());
}
BENCHMARK(propagation)->ArgsProduct(kUpdates)->UseManualTime();

/// The refit of every node; items are nodes.
void refitAll(benchmark::State& state) {
  update(state, adaptive_bvh::FitnessCriterion::RefitAll,
         [](const auto& report) { return report.seconds(); });
  state.SetItemsProcessed(state.iterations() * helmetOf(int(state.range(0))).getNumBVs());
}
BENCHMARK(refitAll)->ArgsProduct(kUpdates)->UseManualTime();

// ---- DeformableMesh -----------------------------------------------------------------------------

Mesh meshOf(int resolution) { return Mesh(scenarios::helmet(resolution).mesh()); }

void countTriangles(benchmark::State& state, const Mesh& mesh) {
  const auto triangles = std::int64_t(mesh.triangles().size());
  state.SetItemsProcessed(state.iterations() * triangles);
  state.counters["triangles"] = double(triangles);
  state.counters["bytes a triangle"] = double(mesh.bytes()) / double(triangles);
}

void meshBuild(benchmark::State& state) {
  const scenarios::Mesh mesh = scenarios::helmet(int(state.range(0))).mesh();
  for (auto _ : state) {
    const Mesh built(mesh);
    benchmark::DoNotOptimize(&built);
  }
  countTriangles(state, Mesh(mesh));
}
BENCHMARK(meshBuild)->Arg(1)->Arg(4)->Arg(16);

void meshUpdate(benchmark::State& state) {
  const scenarios::Body body = scenarios::helmet(int(state.range(0)));
  const std::vector<scenarios::Point> steps[] = {body.positions(9), body.positions(10)};
  Mesh mesh = meshOf(int(state.range(0)));
  int i = 0;
  for (auto _ : state) mesh.update(steps[i++ % 2]);
  countTriangles(state, mesh);
}
BENCHMARK(meshUpdate)->Arg(1)->Arg(4)->Arg(16);

/// The same of the 320 triangles of a small sheet.
void smallMeshUpdate(benchmark::State& state) {
  const scenarios::Mesh sheet = scenarios::grid(16, 10, 1.6, 1);
  std::vector<scenarios::Point> steps[] = {sheet.vertices, sheet.vertices};
  for (scenarios::Point& p : steps[1]) p[2] += 0.01 * p[0];
  Mesh mesh(sheet);
  int i = 0;
  for (auto _ : state) mesh.update(steps[i++ % 2]);
  countTriangles(state, mesh);
}
BENCHMARK(smallMeshUpdate);

/// A snapshot: made anew, and into the memory of the one before.
void meshCopy(benchmark::State& state) {
  const Mesh mesh = meshOf(int(state.range(0)));
  for (auto _ : state) {
    const Mesh copy(mesh);
    benchmark::DoNotOptimize(&copy);
  }
  countTriangles(state, mesh);
}
BENCHMARK(meshCopy)->Arg(1)->Arg(4)->Arg(16);
void meshAssignment(benchmark::State& state) {
  const Mesh mesh = meshOf(int(state.range(0)));
  Mesh copy(mesh);
  for (auto _ : state) {
    copy = mesh;
    benchmark::DoNotOptimize(&copy);
  }
  countTriangles(state, mesh);
}
BENCHMARK(meshAssignment)->Arg(1)->Arg(4)->Arg(16);

/// Two meshes so far apart that their roots decide: do they touch, are they near?
void rejectedAtTheRoot(benchmark::State& state) {
  const Mesh first = meshOf(4), second = first;
  const bool collides = state.range(0) != 0;
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  fcl::Transform3d far = origin;
  far.translation().x() = 100;
  const fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  bool found = false;
  for (auto _ : state) {
    if (collides)
      found |= adaptive_bvh::collide(&first, origin, &second, far, request, result) > 0;
    else
      found |= isNearer(first, origin, second, far, 1.);
  }
  if (found) state.SkipWithError("found something");
}
BENCHMARK(rejectedAtTheRoot)->Arg(0)->Arg(1);

}  // namespace

BENCHMARK_MAIN();
