#pragma once

#include <algorithm>
#include <type_traits>

#include <fcl/geometry/collision_geometry.h>

#include "base/task_pool.h"
#include "deformable/mesh_state.h"
#include "mesh/vertex_summary.h"

namespace adaptive_bvh {

/// New positions of a mesh in its user's numbers, wherever they lie: position i begins at
/// data + i * stride, and its components are `component` numbers apart.
template <typename S>
struct PositionArray {
  const S* data;
  std::ptrdiff_t stride = 3, component = 1;

  fcl::Vector3<S> operator[](std::size_t i) const {
    const S* const at = data + static_cast<std::ptrdiff_t>(i) * stride;
    return {at[0], at[component], at[2 * component]};
  }
  /// Calls use(points, first, count) for all positions from `begin` to `end`, some at a time, as
  /// points in double precision that lie together: in place, or copied where they do not lie so.
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

inline std::vector<fcl::Vector3d> inDouble(std::vector<fcl::Vector3d> points) { return points; }
inline std::vector<fcl::Vector3d> inDouble(const std::vector<fcl::Vector3f>& points) {
  std::vector<fcl::Vector3d> converted;
  converted.reserve(points.size());
  for (const fcl::Vector3f& x : points) converted.push_back(x.cast<double>());
  return converted;
}

/// Builds all that a mesh has of its vertices and triangles, which must be usable.
template <typename S>
void build(std::vector<fcl::Vector3<S>> vertices, std::vector<fcl::Triangle> triangles,
           HeldMesh<S>& mesh, fcl::CollisionGeometry<S>& geometry);

/// Throws std::invalid_argument unless a mesh can be built of these; and positions can be used.
template <typename S>
void requireBuildable(const std::vector<fcl::Vector3<S>>& vertices,
                      const std::vector<fcl::Triangle>& triangles);
template <typename S>
void requireUsable(const std::vector<fcl::Vector3<S>>& positions);

/// As build, with a tree that is there. `axes`: along which the boxes lie, or null.
template <typename S>
void assemble(std::vector<fcl::Vector3<S>> vertices, std::vector<fcl::Triangle> triangles,
              const OrderedTree& order, const fcl::Matrix3d* axes, HeldMesh<S>& mesh,
              fcl::CollisionGeometry<S>& geometry);

/// What a step gives positions of: all vertices, all with those before kept, or some.
enum class StepOf { All, TwoFrames, Some };

/// The memory of a step. All that a step allocates is allocated here; and all that it will ever
/// write to in the state.
struct StepMemory {
  template <typename S>
  StepMemory(HeldMesh<S>& mesh, StepOf of);

  const TaskPool pool;
  PerThread<VertexSummary<double>> seen;
  PerThread<double> squares;
};

/// A step of all vertices; `two_frames`: the present positions become those before. Throws where
/// positions are not usable; nothing that can be seen has changed then. Allocates nothing.
/// `geometry`: whose local box follows. `memory` serves one step.
template <typename S>
void takeStep(HeldMesh<S>& mesh, fcl::CollisionGeometry<S>& geometry,
              const PositionArray<S>& positions, bool two_frames, StepMemory& memory);

/// A step of some vertices, likewise; but positions that lie in the mesh are copied first.
template <typename S>
void takeStep(HeldMesh<S>& mesh, fcl::CollisionGeometry<S>& geometry, const unsigned* indices,
              const fcl::Vector3<S>* positions, std::size_t count, const StepMemory& memory);

}  // namespace adaptive_bvh
