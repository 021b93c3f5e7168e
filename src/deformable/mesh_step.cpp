#include "deformable/mesh_step.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/stopwatch.h"
#include "boxes/wide_tree.h"
#include "hierarchy/bottom_up.h"
#include "mesh/vertex_summary.h"

namespace adaptive_bvh {
namespace {

std::uint64_t newNumber() {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

template <typename S>
bool isUsablePosition(const fcl::Vector3<S>& position) {
  return position.cwiseAbs().maxCoeff() <= rounding::largestCoordinate<S>() && position.allFinite();
}

/// Throws unless position i, of vertex indexOf(i), can be used for every i.
template <typename S, typename Positions, typename IndexOf>
void requireUsable(const Positions& positions, std::size_t count, const IndexOf& indexOf) {
  for (std::size_t i = 0; i < count; ++i) {
    const fcl::Vector3<S>& x = positions[i];  // of an array with strides a copy
    if (isUsablePosition<S>(x)) continue;
    int k = 0;
    while (std::abs(x[k]) <= rounding::largestCoordinate<S>()) ++k;
    throw std::invalid_argument("DeformableMesh: coordinate " + std::string(1, "xyz"[k]) +
                                " of vertex " + std::to_string(indexOf(i)) + " is " +
                                std::to_string(x[k]) + (std::isfinite(x[k]) ? ", too large" : ""));
  }
}

/// Along the body's axes, from its middle. Those of the body are below a half: there is room for
/// another body of its size beside it (TreePair::align).
template <typename S>
BodyCoordinates coordinatesOf(const MeshState<S>& state,
                              const fcl::CollisionGeometry<S>& geometry) {
  constexpr double kSlack = 1 + 1. / (1 << 16);  // for what the radius is rounded by
  return BodyCoordinates::about(geometry.aabb_center.template cast<double>(), state.axes.axes(),
                                4 * kSlack * static_cast<double>(geometry.aabb_radius));
}

/// Writes the positions, and sets the radius of the ball around the middle that holds them.
template <typename S>
void writeAll(MeshState<S>& state, fcl::CollisionGeometry<S>& geometry,
              const PositionArray<S>& positions, StepMemory<S>& memory) {
  const fcl::Vector3<S> middle = geometry.aabb_center;
  fcl::Vector3<S>* const vertices = state.vertices.data();
  const TaskPool& pool = memory.pool;
  pool.forEachPart(
      static_cast<int>(state.vertices.size()), pool.parts(), [&](int begin, int end, int slot) {
        S& most = memory.squares[slot];
        positions.forEachRun(
            std::size_t(begin), std::size_t(end),
            [&](const fcl::Vector3<S>* points, std::size_t first, std::size_t count) {
              most = std::max(most, copyPoints(points, count, middle, vertices + first));
            });
      });
  setLocalRadius(geometry, memory.squares.sum([](S& all, S part) { all = std::max(all, part); }));
}

/// What a step knows of its positions, before anything is written.
template <typename S>
VertexSummary<S> summaryOf(const MeshState<S>& state, const PositionArray<S>& positions,
                           StepMemory<S>& memory) {
  const fcl::Vector3<S>* const vertices = state.vertices.data();
  const TaskPool& pool = memory.pool;
  pool.forEachPart(static_cast<int>(state.vertices.size()), pool.parts(),
                   [&](int begin, int end, int slot) {
                     positions.forEachRun(
                         std::size_t(begin), std::size_t(end),
                         [&](const fcl::Vector3<S>* points, std::size_t first, std::size_t count) {
                           memory.seen[slot].add(points, vertices + first, count);
                         });
                   });
  return memory.seen.sum(
      [](VertexSummary<S>& all, const VertexSummary<S>& part) { all.add(part); });
}

template <typename S>
void refit(MeshState<S>& state, const fcl::CollisionGeometry<S>& geometry, const TaskPool& pool) {
  state.tree.refit(state.vertices.data(), coordinatesOf(state, geometry), pool);
  state.positions = newNumber();
}

/// Adds a motion, rounded up.
template <typename S>
void addTravel(MeshState<S>& state) {
  if (state.is_copy) state.lineage = newNumber();
  state.is_copy = false;
  state.travel = rounding::sum(state.travel, state.report.largest_displacement);
}

/// With fewer triangles, handing tasks to threads costs more than they gain.
template <typename S>
int threadsOf(const MeshState<S>& state) {
  constexpr std::size_t kParallelTriangles = 50000;
  return state.topology->triangles.size() >= kParallelTriangles ? state.update_threads : 1;
}

}  // namespace

template <typename S>
StepMemory<S>::StepMemory(MeshState<S>& state, StepOf of)
    : pool(threadsOf(state)), seen(pool.size()), squares(pool.size()) {
  state.tree.reserve(pool);
  if (of == StepOf::TwoFrames) state.previous.reserve(state.vertices.size());
  if (of == StepOf::Some && state.moved.isEmpty())
    state.moved = MovedLeaves(state.tree, state.vertices.size());
}

template <typename S>
void requireUsable(const std::vector<fcl::Vector3<S>>& positions) {
  requireUsable<S>(positions, positions.size(), [](std::size_t i) { return i; });
}

template <typename S>
void requireBuildable(const std::vector<fcl::Vector3<S>>& vertices,
                      const std::vector<fcl::Triangle>& triangles) {
  if (triangles.empty()) throw std::invalid_argument("DeformableMesh: there are no triangles");
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (triangles[t][k] >= vertices.size())
        throw std::invalid_argument("DeformableMesh: triangle " + std::to_string(t) +
                                    " names vertex " + std::to_string(triangles[t][k]) + " of " +
                                    std::to_string(vertices.size()));
  requireUsable(vertices);
}

template <typename S>
void build(std::vector<fcl::Vector3<S>> vertices, std::vector<fcl::Triangle> triangles,
           MeshState<S>& state, fcl::CollisionGeometry<S>& geometry) {
  requireBuildable(vertices, triangles);
  const MeshView<S> mesh{vertices.data(), nullptr, triangles.data()};
  const OrderedTree order(buildBottomUp(mesh, static_cast<unsigned>(triangles.size())));
  assemble(std::move(vertices), std::move(triangles), order, nullptr, state, geometry);
}

template <typename S>
void assemble(std::vector<fcl::Vector3<S>> vertices, std::vector<fcl::Triangle> triangles,
              const OrderedTree& order, const fcl::Matrix3d* axes, MeshState<S>& state,
              fcl::CollisionGeometry<S>& geometry) {
  const MeshView<S> mesh{vertices.data(), nullptr, triangles.data()};
  auto topology = std::make_shared<MeshTopology>();
  topology->leaves.adopt(order, mesh, triangles.size(), vertices.size());
  topology->owners.adopt(mesh, vertices.size(), order.primitives);
  topology->vertex_triangles.adopt(mesh, triangles.size(), vertices.size());
  topology->components.adopt(mesh, triangles.size(), vertices.size());
  state.tree = WideTree(order, {topology, &topology->leaves});
  topology->features.adopt(state.tree, topology->owners);
  topology->contours.adopt(state.tree);
  topology->shape = shapeOf(order);
  topology->triangles = std::move(triangles);
  state.vertices = std::move(vertices);
  state.topology = std::move(topology);
  state.lineage = newNumber();
  const VertexSlots& slots = state.topology->leaves.slots;
  axes ? state.axes.start(state.vertices, slots, *axes) : state.axes.start(state.vertices, slots);

  const LocalBox<S> box(state.vertices.data(), state.vertices.size());
  setLocalBox(geometry, box.low, box.high);
  StepMemory<S> memory(state, StepOf::All);
  writeAll(state, geometry, PositionArray<S>{state.vertices[0].data()}, memory);
  refit(state, geometry, memory.pool);
}

template <typename S>
void takeStep(MeshState<S>& state, fcl::CollisionGeometry<S>& geometry,
              const PositionArray<S>& positions, bool two_frames, StepMemory<S>& memory) {
  Stopwatch watch;
  const std::size_t count = state.vertices.size();
  const VertexSummary<S> seen = summaryOf(state, positions, memory);
  if (!seen.isSurelyUsable()) requireUsable<S>(positions, count, [](std::size_t i) { return i; });
  // Nothing is thrown from here on.
  state.report = MeshUpdate();
  state.report.vertices = count;
  state.report.largest_displacement = static_cast<double>(seen.largestDisplacement());
  if (two_frames) {
    state.previous.resize(count);
    state.previous.swap(state.vertices);
  }
  if (seen.moved()) {
    setLocalBox(geometry, seen.low, seen.high);
    writeAll(state, geometry, positions, memory);
    state.report.turned = state.axes.turn(state.vertices);
    refit(state, geometry, memory.pool);
    addTravel(state);
  } else if (two_frames) {
    state.vertices = state.previous;
  }
  if (!two_frames) state.previous.clear();
  state.report.seconds = watch.lap();
}

namespace {

/// Whether the coordinates of a tree have room for a point: they are below 2.
bool fits(const BodyCoordinates& coordinates, const fcl::Vector3d& x) {
  return coordinates(x).cwiseAbs().maxCoeff() < 2 - 1. / 1024;
}

/// Throws unless the indices name vertices and the positions can be used.
template <typename S>
void requireUsable(const MeshState<S>& state, const unsigned* indices,
                   const fcl::Vector3<S>* positions, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (indices[i] >= state.vertices.size())
      throw std::invalid_argument("DeformableMesh: index " + std::to_string(indices[i]) +
                                  " given for " + std::to_string(state.vertices.size()) +
                                  " vertices");
  requireUsable<S>(positions, count, [&](std::size_t i) { return indices[i]; });
}

}  // namespace

template <typename S>
void takeStep(MeshState<S>& state, fcl::CollisionGeometry<S>& geometry, const unsigned* indices,
              const fcl::Vector3<S>* positions, std::size_t count, const StepMemory<S>& memory) {
  Stopwatch watch;
  requireUsable(state, indices, positions, count);
  std::vector<fcl::Vector3<S>> aside;
  if (overlap(positions, count, state.vertices.data(), state.vertices.size())) {
    aside.assign(positions, positions + count);
    positions = aside.data();
  }
  // Nothing is thrown from here on.
  state.report = MeshUpdate();
  state.report.vertices = count;
  BoxAfterSome<S> box(geometry);
  bool has_moved = false, has_room = true;
  state.moved.forEachLast(indices, count, [&](std::size_t i) {
    fcl::Vector3<S>& vertex = state.vertices[indices[i]];
    const fcl::Vector3<S> to = positions[i];
    if (vertex == to) return;
    box.move(vertex, to);
    vertex = to;
    state.moved.add(indices[i]);
    has_moved = true;
    has_room = has_room && fits(state.tree.coordinates(), to.template cast<double>());
  });
  state.previous.clear();
  if (!has_moved) {
    state.report.seconds = watch.lap();
    return;
  }
  box.finish(state.vertices.data(), state.vertices.size(), geometry);
  state.report.turned = state.axes.turn(state.vertices);
  if (!has_room || state.report.turned) {
    state.moved.refitAll([](int) {});
    refit(state, geometry, memory.pool);
  } else {
    state.moved.refitAll([&](int node) { state.tree.refitNode(state.vertices.data(), node); });
    state.positions = newNumber();
  }
  const S largest =
      std::sqrt(box.squaredDisplacement()) * (1 + 8 * rounding::epsilon<S>()) + rounding::tiny<S>();
  state.report.largest_displacement = static_cast<double>(largest);
  addTravel(state);
  state.report.seconds = watch.lap();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                                \
  template void build(std::vector<fcl::Vector3<S>>, std::vector<fcl::Triangle>, MeshState<S>&,     \
                      fcl::CollisionGeometry<S>&);                                                 \
  template void requireBuildable(const std::vector<fcl::Vector3<S>>&,                              \
                                 const std::vector<fcl::Triangle>&);                               \
  template void requireUsable(const std::vector<fcl::Vector3<S>>&);                                \
  template void assemble(std::vector<fcl::Vector3<S>>, std::vector<fcl::Triangle>,                 \
                         const OrderedTree&, const fcl::Matrix3d*, MeshState<S>&,                  \
                         fcl::CollisionGeometry<S>&);                                              \
  template StepMemory<S>::StepMemory(MeshState<S>&, StepOf);                                       \
  template void takeStep(MeshState<S>&, fcl::CollisionGeometry<S>&, const PositionArray<S>&, bool, \
                         StepMemory<S>&);                                                          \
  template void takeStep(MeshState<S>&, fcl::CollisionGeometry<S>&, const unsigned*,               \
                         const fcl::Vector3<S>*, std::size_t, const StepMemory<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
