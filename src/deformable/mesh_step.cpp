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
#include "mesh/local_bounds.h"
#include "mesh/position_errors.h"
#include "mesh/vertex_summary.h"

namespace adaptive_bvh {
namespace {

/// A number for a new lineage or version: one that was never returned before.
std::uint64_t newNumber() {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

/// Throws unless position i, of vertex indexOf(i), can be used for every i.
template <typename Positions, typename IndexOf>
void requireUsable(const Positions& positions, std::size_t count, const IndexOf& indexOf) {
  requireUsablePositions<double>("DeformableMesh", positions, count, indexOf);
}

/// Tree coordinates along the body's axes, with its centre as origin. The body's coordinates are
/// below a half: this leaves room for another body of its size beside it (TreePair::align).
BodyCoordinates coordinatesOf(const MeshState& state) {
  constexpr double kSlack = 1 + 1. / (1 << 16);  // covers the rounding of the radius
  return BodyCoordinates::about(state.bounds.aabb_center, state.axes.axes(),
                                4 * kSlack * state.bounds.aabb_radius);
}

/// Writes the positions, and sets the radius of the enclosing ball around the centre of the box.
void writeAll(MeshState& state, const PositionArray& positions, StepMemory& memory) {
  const fcl::Vector3d middle = state.bounds.aabb_center;
  fcl::Vector3d* const vertices = state.vertices.data();
  const TaskPool& pool = memory.pool;
  pool.forEachPart(
      static_cast<int>(state.vertices.size()), pool.parts(), [&](int begin, int end, int slot) {
        double& most = memory.squared_radius[slot];
        positions.forEachRun(
            std::size_t(begin), std::size_t(end),
            [&](const fcl::Vector3d* points, std::size_t first, std::size_t count) {
              most = std::max(most, copyPoints(points, count, middle, vertices + first));
            });
      });
  setLocalRadius(state.bounds, memory.squared_radius.sum(
                                   [](double& all, double part) { all = std::max(all, part); }));
}

/// The bounding box of the new positions and the largest displacement, before anything is written.
VertexSummary<double> summaryOf(const MeshState& state, const PositionArray& positions,
                                StepMemory& memory) {
  const fcl::Vector3d* const vertices = state.vertices.data();
  const TaskPool& pool = memory.pool;
  pool.forEachPart(static_cast<int>(state.vertices.size()), pool.parts(),
                   [&](int begin, int end, int slot) {
                     positions.forEachRun(
                         std::size_t(begin), std::size_t(end),
                         [&](const fcl::Vector3d* points, std::size_t first, std::size_t count) {
                           memory.summary[slot].add(points, vertices + first, count);
                         });
                   });
  return memory.summary.sum(
      [](VertexSummary<double>& all, const VertexSummary<double>& part) { all.add(part); });
}

/// Refits the tree to the positions, in new coordinates.
void refit(MeshState& state, const TaskPool& pool) {
  state.tree.refit(state.vertices.data(), coordinatesOf(state), pool);
  state.version = newNumber();
}

/// Adds the displacement to the accumulated motion bound, rounded up. A copy begins a new lineage
/// (MeshState::lineage).
void addTravel(MeshState& state) {
  if (state.is_copy) state.lineage = newNumber();
  state.is_copy = false;
  state.travel = rounding::sum(state.travel, state.report.largest_displacement);
}

/// The nodes of a four-wide tree, for updates of some vertices.
DirtyNodes dirtyNodesOf(const WideTree& tree, std::size_t num_vertices) {
  std::vector<unsigned> parents(static_cast<std::size_t>(tree.size()), 0);
  for (int n = 0; n < tree.size(); ++n) {
    const WideNode& node = tree.nodes()[n];
    for (int i = 0; i < node.count && !node.isLeaf(); ++i)
      parents[static_cast<std::size_t>(node.below[i])] = static_cast<unsigned>(n);
  }
  return {num_vertices, std::move(parents), [&](const auto& visit) {
            for (int n = 0; n < tree.size(); ++n) {
              const WideNode& node = tree.nodes()[n];
              for (int i = 0; i < node.count && node.isLeaf(); ++i)
                for (int k = 0; k < 3; ++k)
                  visit(static_cast<unsigned>(tree.corners(unsigned(node.first + i))[k]),
                        static_cast<unsigned>(n));
            }
          }};
}

/// The number of threads for an update; 1 for small meshes, where distributing tasks costs more
/// than it gains.
int threadsOf(const MeshState& state) {
  constexpr std::size_t kParallelTriangles = 50000;
  return state.topology->triangles.size() >= kParallelTriangles ? state.threads : 1;
}

}  // namespace

StepMemory::StepMemory(MeshState& state, UpdateKind kind)
    : pool(threadsOf(state)), summary(pool.size()), squared_radius(pool.size()) {
  state.tree.reserve(pool);
  if (kind == UpdateKind::TwoFrames) state.previous.reserve(state.vertices.size());
  if (kind == UpdateKind::Some && state.moved.isEmpty())
    state.moved = dirtyNodesOf(state.tree, state.vertices.size());
}

void requireUsable(const std::vector<fcl::Vector3d>& positions) {
  requireUsable(positions, positions.size(), [](std::size_t i) { return i; });
}

void requireBuildable(const std::vector<fcl::Vector3d>& vertices,
                      const std::vector<fcl::Triangle>& triangles) {
  if (triangles.empty()) throw std::invalid_argument("DeformableMesh: there are no triangles");
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (triangles[t][k] >= vertices.size())
        throw std::invalid_argument("DeformableMesh: triangle " + std::to_string(t) +
                                    " names vertex " +
                                    std::to_string(std::ptrdiff_t(triangles[t][k])) + " of " +
                                    std::to_string(vertices.size()));
  requireUsable(vertices);
}

void build(std::vector<fcl::Vector3d> vertices, std::vector<fcl::Triangle> triangles,
           MeshState& state, fcl::CollisionGeometryd& geometry) {
  requireBuildable(vertices, triangles);
  const MeshView<double> view{vertices.data(), nullptr, triangles.data()};
  const OrderedTree order(buildBottomUp(view, static_cast<unsigned>(triangles.size())));
  buildFromTree(std::move(vertices), std::move(triangles), order, nullptr, state, geometry);
}

namespace {

/// Sets all of a mesh's state except positions and boxes of the tree, radius and version.
void buildState(std::vector<fcl::Vector3d> vertices, std::vector<fcl::Triangle> triangles,
                const OrderedTree& order, const fcl::Matrix3d* axes, MeshState& state) {
  const MeshView<double> mesh{vertices.data(), nullptr, triangles.data()};
  auto topology = std::make_shared<MeshTopology>();
  topology->leaves.assign(order, mesh, triangles.size(), vertices.size());
  std::vector<BoundaryEdge> boundary;
  topology->owners.assign(mesh, vertices.size(), order.primitives, boundary);
  topology->vertex_triangles.assign(mesh, triangles.size(), vertices.size());
  topology->boundary.assign(boundary);
  topology->components.assign(mesh, triangles.size(), vertices.size());
  state.tree = WideTree(order, {topology, &topology->leaves});
  topology->features.assign(state.tree, topology->owners);
  topology->contours.assign(state.tree);
  topology->shape = shapeOf(order);
  topology->triangles = std::move(triangles);
  state.vertices = std::move(vertices);
  state.topology = std::move(topology);
  state.lineage = newNumber();
  const VertexSlots& slots = state.topology->leaves.slots;
  axes ? state.axes.start(state.vertices, slots, *axes) : state.axes.start(state.vertices, slots);
  const LocalBox<double> box(state.vertices.data(), state.vertices.size());
  setLocalBox(state.bounds, box.low, box.high);
}

}  // namespace

void buildFromTree(std::vector<fcl::Vector3d> vertices, std::vector<fcl::Triangle> triangles,
                   const OrderedTree& order, const fcl::Matrix3d* axes, MeshState& state,
                   fcl::CollisionGeometryd& geometry) {
  buildState(std::move(vertices), std::move(triangles), order, axes, state);
  StepMemory memory(state, UpdateKind::All);
  // Copies the positions to themselves, for the radius that this computes.
  writeAll(state, PositionArray{state.vertices[0].data()}, memory);
  refit(state, memory.pool);
  copyBounds(state.bounds, geometry);
}

void takeStep(MeshState& state, fcl::CollisionGeometryd& geometry, const PositionArray& positions,
              bool two_frames, StepMemory& memory) {
  Stopwatch watch;
  const std::size_t count = state.vertices.size();
  const VertexSummary<double> summary = summaryOf(state, positions, memory);
  // isSurelyUsable may be false for usable positions; then each is tested.
  if (!summary.isSurelyUsable()) requireUsable(positions, count, [](std::size_t i) { return i; });
  // Nothing is thrown from here on.
  state.report = MeshUpdate();
  state.report.vertices = count;
  state.report.largest_displacement = summary.largestDisplacement();
  if (two_frames) {
    state.previous.resize(count);
    state.previous.swap(state.vertices);  // writeAll overwrites all vertices
  }
  if (summary.moved()) {
    setLocalBox(state.bounds, summary.low, summary.high);
    writeAll(state, positions, memory);
    state.report.turned = state.axes.update(state.vertices);
    refit(state, memory.pool);
    addTravel(state);
  } else if (two_frames) {
    state.vertices = state.previous;  // the swap has exchanged them
  }
  if (!two_frames) state.previous.clear();
  copyBounds(state.bounds, geometry);
  state.report.seconds = watch.lap();
}

namespace {

/// Whether a point is in the range of a tree's coordinates, which are below 2, with some slack.
bool fits(const BodyCoordinates& coordinates, const fcl::Vector3d& x) {
  return coordinates(x).cwiseAbs().maxCoeff() < 2 - 1. / 1024;
}

/// Throws unless the indices are in range and the positions are usable.
void requireUsable(const MeshState& state, const unsigned* indices, const fcl::Vector3d* positions,
                   std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (indices[i] >= state.vertices.size())
      throw std::invalid_argument("DeformableMesh: index " + std::to_string(indices[i]) +
                                  " given for " + std::to_string(state.vertices.size()) +
                                  " vertices");
  requireUsable(positions, count, [&](std::size_t i) { return indices[i]; });
}

/// An update of some vertices: `move` writes their positions; then `finish` updates the mesh's
/// bounds, axes and tree.
class MovedVertices {
 public:
  explicit MovedVertices(MeshState& state) : state_(state), box_(state.bounds.aabb_local) {}

  void move(const unsigned* indices, const fcl::Vector3d* positions, std::size_t count) {
    state_.moved.forEachLast(indices, count, [&](std::size_t i) {
      fcl::Vector3d& vertex = state_.vertices[indices[i]];
      const fcl::Vector3d to = positions[i];
      if (vertex == to) return;
      box_.move(vertex, to);
      vertex = to;
      state_.moved.add(indices[i]);
      has_moved_ = true;
      fits_ = fits_ && fits(state_.tree.coordinates(), to);
    });
  }
  bool hasMoved() const { return has_moved_; }
  /// Refits only the nodes above moved vertices, unless the tree needs other coordinates.
  void finish(const TaskPool& pool) {
    box_.finish(state_.vertices.data(), state_.vertices.size(), state_.bounds);
    state_.report.turned = state_.axes.update(state_.vertices);
    if (!fits_ || state_.report.turned) {
      state_.moved.unmarkAll();
      refit(state_, pool);
    } else {
      for (int node = state_.moved.size(); (node = state_.moved.before(node)) >= 0;) {
        state_.tree.refitNode(state_.vertices.data(), node);
        state_.moved.unmark(node);
      }
      state_.version = newNumber();
    }
    state_.report.largest_displacement =
        std::sqrt(box_.squaredDisplacement()) * (1 + 8 * rounding::epsilon<double>()) +
        rounding::tiny<double>();
    addTravel(state_);
  }

 private:
  MeshState& state_;
  BoxAfterSome<double> box_;
  bool has_moved_ = false, fits_ = true;
};

}  // namespace

void takeStep(MeshState& state, fcl::CollisionGeometryd& geometry, const unsigned* indices,
              const fcl::Vector3d* positions, std::size_t count, const StepMemory& memory) {
  Stopwatch watch;
  requireUsable(state, indices, positions, count);
  std::vector<fcl::Vector3d> copy;
  if (overlap(positions, count, state.vertices.data(), state.vertices.size())) {
    copy.assign(positions, positions + count);
    positions = copy.data();
  }
  // Nothing is thrown from here on.
  state.report = MeshUpdate();
  state.report.vertices = count;
  MovedVertices moved(state);
  moved.move(indices, positions, count);
  state.previous.clear();
  if (moved.hasMoved()) moved.finish(memory.pool);
  copyBounds(state.bounds, geometry);
  state.report.seconds = watch.lap();
}

}  // namespace adaptive_bvh
