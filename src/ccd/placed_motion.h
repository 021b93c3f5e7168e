#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "ccd/continuous_search.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// Throws std::invalid_argument with this message.
[[noreturn]] void refuseMotion(const std::string& what);

/// Transforms positions to the world. Returns a bound of the size of the
/// numbers that are rounded; 0 if the transform is the identity. Throws std::invalid_argument if a
/// position is not finite, or too large.
double toWorld(const fcl::Vector3d* positions, std::size_t count, const fcl::Transform3d& tf,
               std::vector<fcl::Vector3d>& world);

/// The motion of a mesh in a query: its vertices at start and end, in the world.
class PlacedMotion {
 public:
  struct Memory {
    std::vector<fcl::Vector3d> start, end;
  };

  /// Transforms positions. Refers to the mesh and to the memory. Throws
  /// std::invalid_argument if a position is not finite, or too large.
  PlacedMotion(const MeshState& mesh, const fcl::Vector3d* start, const fcl::Vector3d* end,
               const fcl::Transform3d& start_tf, const fcl::Transform3d& end_tf, Memory& memory);

  /// The query of this mesh and another one, or itself. Refers to both.
  ContinuousQuery with(const PlacedMotion& second, double separation) const {
    return {mesh_, second.mesh_, separation, std::max(threads_, second.threads_)};
  }
  const MovingMesh& mesh() const { return mesh_; }
  /// Reads the links of the mesh's tree where they are now, after the mesh was assigned a copy.
  void findLinks(const MeshState& mesh) { mesh_.nodes = mesh.tree.nodes(); }

 private:
  MovingMesh mesh_;
  int threads_;
};

}  // namespace adaptive_bvh
