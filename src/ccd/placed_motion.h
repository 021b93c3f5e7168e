#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "ccd/continuous_search.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// Throws std::invalid_argument with this message.
[[noreturn]] void refuseMotion(const std::string& what);

/// The motion of a mesh in a query: its vertices at start and end, as doubles in the world.
class PlacedMotion {
 public:
  struct Memory {
    std::vector<fcl::Vector3d> start, end;
  };

  /// Transforms positions of either number type. Refers to the mesh and to the memory. Throws
  /// std::invalid_argument if a position is not finite, or too large.
  template <typename S>
  PlacedMotion(const MeshState& mesh, const fcl::Vector3<S>* start, const fcl::Vector3<S>* end,
               const fcl::Transform3d& start_tf, const fcl::Transform3d& end_tf, Memory& memory);

  /// The query of this mesh and another one, or itself. Refers to both.
  ContinuousQuery with(const PlacedMotion& second, double separation) const {
    return {mesh_, second.mesh_, separation, std::max(threads_, second.threads_)};
  }
  ContinuousQuery withItself(double separation) const { return with(*this, separation); }

 private:
  MovingMesh mesh_;
  int threads_;
};

}  // namespace adaptive_bvh
