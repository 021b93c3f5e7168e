#pragma once

#include <array>

#include "query/within/kept_meshes.h"
#include "query/within/tracked_triangles.h"

namespace adaptive_bvh {

/// The triangles of two meshes, or of one, that occur in candidates of a ContactSet; where they
/// are, and how they move, in a unit that both have in common.
class TrackedMeshes {
 public:
  /// `is_self`: one mesh with itself, whose triangles are tracked once.
  explicit TrackedMeshes(bool is_self = false) : is_self_(is_self) {}

  TrackedTriangles& operator[](int side) { return sides_[is_self_ ? 0 : std::size_t(side)]; }
  const TrackedTriangles& operator[](int side) const {
    return sides_[is_self_ ? 0 : std::size_t(side)];
  }
  /// Brings positions and motion up to date. Returns false if the motion is counted from now on:
  /// because `is_new`, or because it cannot be measured in the unit any more.
  bool update(const KeptMeshes& meshes, double distance, bool is_new) {
    if (!is_new && follows(meshes)) return true;
    restart(meshes, distance);
    return false;
  }

  const MotionUnit& unit() const { return unit_; }
  /// Bounds the error of distances that are near the limit.
  double rounding() const { return rounding_; }

 private:
  bool follows(const KeptMeshes& meshes);
  void restart(const KeptMeshes& meshes, double distance);
  bool read(const KeptMeshes& meshes);
  float measure(const KeptMeshes& meshes);

  bool is_self_;
  std::array<TrackedTriangles, 2> sides_;
  MotionUnit unit_;
  double radii_ = 0;  ///< when the tracking began
  double rounding_ = 0;
};

}  // namespace adaptive_bvh
