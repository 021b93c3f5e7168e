#pragma once

#include <algorithm>
#include <type_traits>

#include <fcl/geometry/collision_geometry.h>

#include "base/task_pool.h"
#include "deformable/mesh_state.h"
#include "mesh/vertex_summary.h"

namespace adaptive_bvh {

/// New positions of a mesh in the user's number type and layout: position i begins at data + i *
/// stride, and its components are `component` numbers apart.
template <typename S>
struct PositionArray {
  const S* data;
  std::ptrdiff_t stride = 3, component = 1;

  fcl::Vector3<S> operator[](std::size_t i) const {
    const S* const x = data + static_cast<std::ptrdiff_t>(i) * stride;
    return {x[0], x[component], x[2 * component]};
  }
  /// Calls use(points, first, count) for consecutive runs of positions from `begin` to `end`, as
  /// contiguous points in double precision: in place if they already have this layout, otherwise
  /// copied.
  template <typename Use>
  void forEachRun(std::size_t begin, std::size_t end, const Use& use) const {
    static_assert(sizeof(fcl::Vector3<S>) == 3 * sizeof(S), "no gaps");
    if constexpr (std::is_same<S, double>::value)
      if (stride == 3 && component == 1)
        return use(reinterpret_cast<const fcl::Vector3d*>(data) + begin, begin, end - begin);
    constexpr std::size_t kRun = 64;
    fcl::Vector3d points[kRun];
    for (std::size_t first = begin, count; first < end; first += count) {
      count = std::min(kRun, end - first);
      for (std::size_t i = 0; i < count; ++i)
        points[i] = (*this)[first + i].template cast<double>();
      use(points, first, count);
    }
  }
};

/// The points in double precision.
inline std::vector<fcl::Vector3d> inDouble(std::vector<fcl::Vector3d> points) { return points; }
inline std::vector<fcl::Vector3d> inDouble(const std::vector<fcl::Vector3f>& points) {
  std::vector<fcl::Vector3d> converted;
  converted.reserve(points.size());
  for (const fcl::Vector3f& x : points) converted.push_back(x.cast<double>());
  return converted;
}

// In the functions below, `mesh` is the private data of a DeformableMesh, and `geometry` is that
// DeformableMesh itself, whose bounds they set.

/// Builds a mesh. Throws std::invalid_argument as requireBuildable does.
template <typename S>
void build(std::vector<fcl::Vector3<S>> vertices, std::vector<fcl::Triangle> triangles,
           HeldMesh<S>& mesh, fcl::CollisionGeometry<S>& geometry);

/// Throws std::invalid_argument unless a mesh can be built of these vertices and triangles, and
/// unless these positions can be used.
template <typename S>
void requireBuildable(const std::vector<fcl::Vector3<S>>& vertices,
                      const std::vector<fcl::Triangle>& triangles);
template <typename S>
void requireUsable(const std::vector<fcl::Vector3<S>>& positions);

/// Builds a mesh with a given binary tree. The vertices and triangles must satisfy
/// requireBuildable. `axes` are those of the boxes, or null to choose them.
template <typename S>
void buildFromTree(std::vector<fcl::Vector3<S>> vertices, std::vector<fcl::Triangle> triangles,
                   const OrderedTree& order, const fcl::Matrix3d* axes, HeldMesh<S>& mesh,
                   fcl::CollisionGeometry<S>& geometry);

/// The kind of an update: new positions of all vertices, of all vertices with the previous
/// positions kept, or of some vertices.
enum class UpdateKind { All, TwoFrames, Some };

/// The memory of one update. Its constructor does all allocations of an update, including those in
/// the mesh's state.
struct StepMemory {
  template <typename S>
  StepMemory(HeldMesh<S>& mesh, UpdateKind kind);

  const TaskPool pool;
  PerThread<VertexSummary<double>> summary;  ///< of the new positions
  PerThread<double> squared_radius;          ///< largest squared distance from the body's centre
};

/// Updates all vertices. With `two_frames`, the current positions become the previous ones. Throws
/// std::invalid_argument if positions are not usable, and then leaves the mesh unchanged. Allocates
/// nothing. Use `memory` for one update only.
template <typename S>
void takeStep(HeldMesh<S>& mesh, fcl::CollisionGeometry<S>& geometry,
              const PositionArray<S>& positions, bool two_frames, StepMemory& memory);

/// Updates the vertices with these indices. Throws as above for positions and for indices that are
/// out of range. Allocates only to copy positions that lie in the mesh's own memory.
template <typename S>
void takeStep(HeldMesh<S>& mesh, fcl::CollisionGeometry<S>& geometry, const unsigned* indices,
              const fcl::Vector3<S>* positions, std::size_t count, const StepMemory& memory);

}  // namespace adaptive_bvh
