#pragma once

#include <cstdint>
#include <limits>

#include "base/rounding.h"
#include "query/within/kept_meshes.h"
#include "query/within/rigid_motion.h"

namespace adaptive_bvh {

/// How far any two points, one of each mesh, have moved one relative to the other: a sum over the
/// updates of the meshes (MeshState::travel) and the changes of the transforms, rounded up. One
/// mesh with itself counts twice. docs/bounds.md, 7.
class PairMotion {
 public:
  /// Adds the motion since the last call.
  void moveTo(const KeptMeshes& meshes) {
    for (int i = 0; i < 2; ++i) {
      const MeshState& mesh = meshes.mesh(i);
      if (mesh.lineage != lineages_[i] || mesh.travel < travels_[i]) is_known_ = false;
      lineages_[i] = mesh.lineage;
      travels_[i] = mesh.travel;
    }
    if (!meshes.is_self && !rigid_.moveTo(meshes.first, meshes.second)) is_known_ = false;
    last_ = sum_;
    sum_ = rounding::sum(rounding::sum(rigid_.sum(), travels_[0]), travels_[1]);
    last_step_ = is_known_ ? since(last_) : std::numeric_limits<double>::infinity();
  }
  /// Counts from now on.
  void restart() {
    start_ = sum_;
    is_known_ = true;
  }

  /// The motion since `restart`; infinite if it is not known, because a mesh was replaced by
  /// another one, or by an older snapshot of itself.
  double sinceRestart() const {
    return is_known_ ? since(start_) : std::numeric_limits<double>::infinity();
  }
  double lastStep() const { return last_step_; }  ///< between the last two calls of moveTo

 private:
  /// The difference from an earlier sum. The last term exceeds the rounding of both sums.
  double since(double before) const {
    constexpr double kRounding = 32 * std::numeric_limits<double>::epsilon();
    return sum_ > before ? sum_ - before + kRounding * sum_ : 0;
  }

  std::uint64_t lineages_[2] = {0, 0};
  double travels_[2] = {0, 0};
  RigidMotion rigid_;
  double sum_ = 0, last_ = 0, start_ = 0, last_step_ = 0;
  bool is_known_ = false;
};

}  // namespace adaptive_bvh
