#pragma once

#include <algorithm>

#include <fcl/geometry/collision_geometry.h>

#include "base/task_pool.h"
#include "deformable/mesh_state.h"
#include "mesh/vertex_summary.h"

namespace adaptive_bvh {

/// New positions of a mesh in the user's layout: position i begins at data + i *
/// stride, and its components are `component` numbers apart.
struct PositionArray {
  const double* data;
  std::ptrdiff_t stride = 3, component = 1;

  fcl::Vector3d operator[](std::size_t i) const {
    const double* const x = data + static_cast<std::ptrdiff_t>(i) * stride;
    return {x[0], x[component], x[2 * component]};
  }
  /// Calls use(points, first, count) for consecutive runs of positions from `begin` to `end`, as
  /// contiguous points: in place if they already have this layout, otherwise copied.
  template <typename Use>
  void forEachRun(std::size_t begin, std::size_t end, const Use& use) const {
    static_assert(sizeof(fcl::Vector3d) == 3 * sizeof(double), "no gaps");
    if (stride == 3 && component == 1)
      return use(reinterpret_cast<const fcl::Vector3d*>(data) + begin, begin, end - begin);
    constexpr std::size_t kRun = 64;
    fcl::Vector3d points[kRun];
    for (std::size_t first = begin, count; first < end; first += count) {
      count = std::min(kRun, end - first);
      for (std::size_t i = 0; i < count; ++i) points[i] = (*this)[first + i];
      use(points, first, count);
    }
  }
};

// In the functions below, `state` is the private data of a DeformableMesh, and `geometry` is that
// DeformableMesh itself, whose bounds they set.

/// Builds a mesh. Throws std::invalid_argument as requireBuildable does.
void build(std::vector<fcl::Vector3d> vertices, std::vector<fcl::Triangle> triangles,
           MeshState& state, fcl::CollisionGeometryd& geometry);

/// Throws std::invalid_argument unless a mesh can be built of these vertices and triangles, and
/// unless these positions can be used.
void requireBuildable(const std::vector<fcl::Vector3d>& vertices,
                      const std::vector<fcl::Triangle>& triangles);
void requireUsable(const std::vector<fcl::Vector3d>& positions);

/// Builds a mesh with a given binary tree. The vertices and triangles must satisfy
/// requireBuildable. `axes` are those of the boxes, or null to choose them.
void buildFromTree(std::vector<fcl::Vector3d> vertices, std::vector<fcl::Triangle> triangles,
                   const OrderedTree& order, const fcl::Matrix3d* axes, MeshState& state,
                   fcl::CollisionGeometryd& geometry);

/// The kind of an update: new positions of all vertices, of all vertices with the previous
/// positions kept, or of some vertices.
enum class UpdateKind { All, TwoFrames, Some };

/// The memory of one update. Its constructor does all allocations of an update, including those in
/// the mesh's state.
struct StepMemory {
  StepMemory(MeshState& state, UpdateKind kind);

  const TaskPool pool;
  PerThread<VertexSummary<double>> summary;  ///< of the new positions
  PerThread<double> squared_radius;          ///< largest squared distance from the body's centre
};

/// Updates all vertices. With `two_frames`, the current positions become the previous ones. Throws
/// std::invalid_argument if positions are not usable, and then leaves the mesh unchanged. Allocates
/// nothing. Use `memory` for one update only.
void takeStep(MeshState& state, fcl::CollisionGeometryd& geometry, const PositionArray& positions,
              bool two_frames, StepMemory& memory);

/// Updates the vertices with these indices. Throws as above for positions and for indices that are
/// out of range. Allocates only to copy positions that lie in the mesh's own memory.
void takeStep(MeshState& state, fcl::CollisionGeometryd& geometry, const unsigned* indices,
              const fcl::Vector3d* positions, std::size_t count, const StepMemory& memory);

}  // namespace adaptive_bvh
