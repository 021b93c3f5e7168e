// The parts of a step, by themselves: one volume test, one refit, one propagation. Items are nodes,
// vertices or fits, so items_per_second compares sizes.
#include <benchmark/benchmark.h>

#include <fcl/math/bv/RSS.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/hierarchy.h"
#include "model_state.h"
#include "scenarios.h"
#include "update/body_fit.h"
#include "volume/volume.h"

namespace {

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

/// An inner refit by extents, of nodes with so many triangles, hot in the cache; then with axes
/// anew.
void bodyFit(benchmark::State& state) {
  Model model = helmetOf(4);
  const adaptive_bvh::AdaptiveTree<fcl::RSSd>& tree =
      adaptive_bvh::detail::ModelAccess<fcl::RSSd>::tree(model);
  const adaptive_bvh::UpdateTarget<fcl::RSSd> target{
      model, const_cast<adaptive_bvh::AdaptiveTree<fcl::RSSd>&>(tree)};
  adaptive_bvh::VertexStates<double> states;
  states.reset(tree.topology.slots.size());
  states.start(target, tree.boxes->frame);
  adaptive_bvh::KeptAxes axes(std::size_t(model.getNumBVs()));
  adaptive_bvh::BodyFit<fcl::RSSd> fit(target, states.data(), nullptr, axes,
                                       adaptive_bvh::RefitPolicy());
  std::vector<int> nodes;
  for (int i = 0; i < model.getNumBVs(); ++i)
    if (model.getBV(i).num_primitives == state.range(0) && nodes.size() < 32) {
      nodes.push_back(i);
      fit.keepAxes(i, model.getBV(i).bv);
    }
  const auto boxes = target.tree.boxes->nodes();
  std::size_t i = 0;
  for (auto _ : state) {
    if (state.range(1)) boxes.setChosenArea(nodes[i], 0);
    benchmark::DoNotOptimize(fit(nodes[i]));
    i = i + 1 < nodes.size() ? i + 1 : 0;
  }
  state.counters["nodes"] = double(nodes.size());
}
BENCHMARK(bodyFit)->ArgsProduct({{1, 2, 4, 8, 16, 64, 256}, {0, 1}});

/// An update without refits; its phase `seconds`.
template <typename Seconds>
void update(benchmark::State& state, Seconds&& seconds) {
  Model model = helmetOf(int(state.range(0)));
  adaptive_bvh::RefitPolicy policy;
  policy.criterion = adaptive_bvh::FitnessCriterion::RefitNone;
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
  update(state, [](const auto& report) { return report.displacement_seconds; });
  state.SetItemsProcessed(state.iterations() * helmetOf(int(state.range(0))).num_vertices);
}
BENCHMARK(displacement)->ArgsProduct(kUpdates)->UseManualTime();

/// The propagation; items are nodes.
void propagation(benchmark::State& state) {
  update(state, [](const auto& report) { return report.propagation_seconds; });
  state.SetItemsProcessed(state.iterations() * helmetOf(int(state.range(0))).getNumBVs());
}
BENCHMARK(propagation)->ArgsProduct(kUpdates)->UseManualTime();

}  // namespace

BENCHMARK_MAIN();
