#include <chrono>
#include <cmath>

#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/tuning.h"
#include "update/propagation.h"

namespace adaptive_bvh {
namespace {

using V = Volume<fcl::RSSd>;
using Point = fcl::Vector3d;

/// Nanoseconds a call, the least of several rounds.
template <typename Work>
double nanoseconds(int calls, Work&& work) {
  double least = 1e300;
  for (int round = 0; round < 7; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) work(i);
    const std::chrono::duration<double, std::nano> elapsed =
        std::chrono::steady_clock::now() - start;
    least = std::min(least, elapsed.count() / calls);
  }
  return least;
}

/// A sheet with hills, 64 x 64 cells.
TriangleMesh<double> hills() {
  constexpr std::size_t kCells = 64;
  TriangleMesh<double> mesh;
  for (std::size_t j = 0; j <= kCells; ++j)
    for (std::size_t i = 0; i <= kCells; ++i) {
      const double x = double(i) / kCells, y = double(j) / kCells;
      mesh.vertices.emplace_back(x, y, 0.2 * std::sin(7 * x) * std::cos(5 * y));
    }
  for (std::size_t j = 0; j < kCells; ++j)
    for (std::size_t i = 0; i < kCells; ++i) {
      const std::size_t v = j * (kCells + 1) + i;
      mesh.triangles.emplace_back(v, v + 1, v + kCells + 2);
      mesh.triangles.emplace_back(v, v + kCells + 2, v + kCells + 1);
    }
  return mesh;
}

}  // namespace

void SimulationWork::add(const UpdateReport& update) {
  inflated += update.inflated;
  refitted_leaves += update.refitted_leaves;
  refitted_inner += update.refitted_inner;
  refitted_primitives += update.refitted_primitives;
}

void SimulationWork::add(const QueryWork& queries) {
  bv_tests += queries.bv_tests;
  leaf_tests += queries.leaf_tests;
}

SimulationWork& SimulationWork::operator+=(const SimulationWork& other) {
  bv_tests += other.bv_tests;
  leaf_tests += other.leaf_tests;
  inflated += other.inflated;
  refitted_leaves += other.refitted_leaves;
  refitted_inner += other.refitted_inner;
  refitted_primitives += other.refitted_primitives;
  seconds += other.seconds;
  return *this;
}

double WorkCosts::seconds(const SimulationWork& work) const {
  return 1e-9 * (bv_test * double(work.bv_tests) + leaf_test * double(work.leaf_tests) +
                 inflated * double(work.inflated) + refitted_leaf * double(work.refitted_leaves) +
                 refitted_inner * double(work.refitted_inner) +
                 refitted_primitive * double(work.refitted_primitives - work.refitted_leaves));
}

WorkCosts WorkCosts::measured() {
  AdaptiveBVHModeld model;
  fillModel(hills(), model);
  const AdaptiveBVHModeld other(model);
  Topology topology;
  topology.adopt(model);
  Tracking<fcl::RSSd> tracking;
  tracking.adopt(model, topology);
  const MeshView<double> mesh = viewOf<fcl::RSSd>(model);
  const int nodes = model.getNumBVs(), triangles = model.num_tris;
  const fcl::Matrix3d R = Eigen::AngleAxisd(0.7, Point(1, 2, 3).normalized()).matrix();
  const Point T(0.2, 0.1, 1.5);
  double sink = 0;  // so that nothing is left out as unused

  WorkCosts costs;
  costs.leaf_test = nanoseconds(20000, [&](int i) {
    const auto corner = [&](int t, int k) -> const Point& {
      return model.vertices[model.tri_indices[t % triangles][k]];
    };
    Point p, q;
    sink += fcl::detail::TriangleDistance<double>::triDistance(
        corner(i, 0), corner(i, 1), corner(i, 2), corner(7 * i + 3, 0), corner(7 * i + 3, 1),
        corner(7 * i + 3, 2), R, T, p, q);
  });
  // A volume test with all that a traversal does around it, in poses near each other.
  const auto query = [&](int i) {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = Eigen::AngleAxisd(0.1 * i, Point(1, 0.2, 3).normalized()).matrix();
    tf.translation() = Point(0.03 * i, 0.1, 0.5);
    fcl::DistanceResultd result;
    sink += adaptive_bvh::distance<double>(&model, fcl::Transform3d::Identity(), &other, tf,
                                           fcl::DistanceRequestd(), result);
  };
  constexpr int kPoses = 40;
  for (int i = 0; i < kPoses; ++i) query(i);
  const QueryWork work = model.recordedWork();
  costs.bv_test =
      (kPoses * nanoseconds(kPoses, query) - costs.leaf_test * double(work.leaf_tests)) /
      double(work.bv_tests);
  tracking.latest.assign(tracking.latest.size(), 1e-9);  // every node changes
  costs.inflated =
      nanoseconds(20, [&](int) { sink += propagate<fcl::RSSd>(model, tracking, true); }) / nodes;
  const auto fit = [&](int count, int calls) {
    return nanoseconds(calls, [&](int i) {
      const int first = i * count % (triangles - count);
      sink += V::fit(mesh, &topology.corners[std::size_t(first)], count).r;
    });
  };
  costs.refitted_leaf = fit(1, 8000);
  const double two = fit(2, 8000), many = fit(512, 100);
  costs.refitted_primitive = (many - two) / 510;
  costs.refitted_inner = std::max(0., two - 2 * costs.refitted_primitive);
  if (!std::isfinite(sink)) costs.bv_test += 1e-9;
  return costs;
}

}  // namespace adaptive_bvh
