#pragma once

#include <array>
#include <vector>

#include "boxes/wide_search.h"
#include "query/within/kept_meshes.h"

namespace adaptive_bvh {

/// How far the vertices of two meshes, or of one, have moved since the trees were searched as a
/// whole: in the frame of the first mesh, as vectors, so that only the motion of two parts relative
/// to each other counts. For each node there is a box around the displacements below it.
class Displacements {
 public:
  /// Whether there is nothing to measure from.
  bool isEmpty() const { return sides_[0].from.empty(); }
  void clear() {
    for (Side& side : sides_) side.from.clear();
  }
  /// Measures from the present positions on.
  void restart(const KeptMeshes& meshes);
  /// Measures the displacements. `limit`: the relative motion of two points that matters.
  void measure(const KeptMeshes& meshes, double limit);

  // As last measured.
  /// The displacements by node, in units of the limit; if `largest` exceeds it, and `moved` is
  /// below 1.
  MovedNodes nodes() const {
    return {sides_[0].nodes.data(), sides_[is_self_ ? 0 : 1].nodes.data()};
  }
  /// Upper bound of the motion of two points relative to each other.
  double largest() const { return largest_; }
  /// The share of the leaves within which two points have moved by more than the limit; 1 if both
  /// meshes have as a whole, or if displacements are too large for single precision.
  double moved() const { return moved_; }
  /// The mean motion of two points of a leaf relative to each other, or that of the meshes if it is
  /// larger.
  double local() const { return local_; }
  /// The standard deviation of the displacements.
  double deviation() const { return deviation_; }

 private:
  struct Side {
    std::vector<fcl::Vector3d> from;  ///< positions
    std::vector<Float4> to;           ///< displacements
    Box all;                          ///< around all of them
    std::vector<Box> nodes;
  };
  struct Sums;

  template <typename ToFirst>
  static void measureVertices(const MeshState& mesh, const ToFirst& to_first, double limit,
                              Side& side, Sums& sums);
  static void fitNodes(const WideTree& tree, Side& side, Sums& sums);

  bool is_self_ = false;
  std::array<Side, 2> sides_;
  double largest_ = 0, moved_ = 0, local_ = 0, deviation_ = 0;
};

}  // namespace adaptive_bvh
