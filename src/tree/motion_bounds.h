#pragma once

#include <algorithm>
#include <vector>

#include "geometry/float4.h"
#include "geometry/rounding.h"

namespace adaptive_bvh {

/// Upper bounds of how far each node's triangles moved and its volume was inflated, in body units,
/// beside a BoxTree. Every sum is rounded up, so that no step is lost in it.
template <typename S>
class MotionBounds {
 public:
  void reset(int nodes) { bounds_.assign(2 * static_cast<std::size_t>(nodes) + 2, 0.f); }

  /// Radius of FCL's volume less its radius when last refitted.
  float inflation(int node) const { return of(node)[0]; }
  void setInflation(int node, float inflation) { of(node)[0] = inflation; }
  /// How far any point below the node has moved since the start, summed over the steps. Between two
  /// steps it grows by at least the motion between them.
  float accumulatedMotion(int node) const { return of(node)[1]; }

  /// Inflation and accumulated motion of the left sibling, then of the right one. With -1: of
  /// nothing, then of the root.
  ADAPTIVE_BVH_INLINE float* ofPair(int left) { return of(left); }

  /// Bounds Volume::cornerSum of all volumes.
  S coordinateSum() const { return coordinate_sum_; }
  /// A volume has been refitted whose Volume::cornerSum this is.
  void include(S corner_sum) { coordinate_sum_ = std::max(coordinate_sum_, corner_sum); }
  /// To be called before volumes are moved for displacements of at most `largest`. A volume whose
  /// displacements have the middle c and half sides h moves by |c|_1 <= 3 largest - |h|_1 and grows
  /// by |h|_2, by `roundingOfMove` and by single precision's share (of a body unit). Rounded up:
  /// steps too small to change the sum must not be lost.
  void extend(S largest, S body_unit) {
    if (!(largest > 0)) return;
    coordinate_sum_ = (coordinate_sum_ + 4 * largest + body_unit * S(1.f / (1ull << 56))) *
                      (1 + 8 * rounding::epsilon<S>());
  }
  /// What moving a volume in a step may round off, in the mesh's units.
  S roundingOfMove() const {
    return 4 * rounding::epsilon<S>() * coordinate_sum_ + rounding::tiny<S>();
  }

  /// Lets the sums begin anew; `include` is to follow for every volume.
  void restart() {
    for (std::size_t i = 1; i < bounds_.size(); i += 2) bounds_[i] = 0;
    coordinate_sum_ = 0;
  }

  std::size_t bytes() const { return bounds_.capacity() * sizeof(float); }

 private:
  const float* of(int node) const { return &bounds_[2 * static_cast<std::size_t>(node + 1)]; }
  float* of(int node) { return &bounds_[2 * static_cast<std::size_t>(node + 1)]; }

  std::vector<float> bounds_;  // two a node, by node + 1
  S coordinate_sum_ = 0;
};

}  // namespace adaptive_bvh
