#pragma once

#include <algorithm>
#include <vector>

#include "geometry/rounding.h"

namespace adaptive_bvh {

/// By how much each volume was inflated since it was last refitted, in body units, and a bound of
/// all volumes' coordinates. Every sum is rounded up, so that no step is lost in it.
template <typename S>
class Inflations {
 public:
  /// Room for `nodes` nodes, none inflated.
  void reset(int nodes) { inflations_.assign(static_cast<std::size_t>(nodes), 0.f); }

  /// Radius of FCL's volume less its radius when last refitted.
  float of(int node) const { return inflations_[static_cast<std::size_t>(node)]; }
  void set(int node, float inflation) { inflations_[static_cast<std::size_t>(node)] = inflation; }
  /// By node.
  float* data() { return inflations_.data(); }

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
    way_ += largest;
    coordinate_sum_ = (coordinate_sum_ + 4 * largest + body_unit * S(1.f / (1ull << 56))) *
                      (1 + 8 * rounding::epsilon<S>());
  }
  /// What moving a volume in a step may round off, in the mesh's units.
  S roundingOfMove() const {
    return 4 * rounding::epsilon<S>() * coordinate_sum_ + rounding::tiny<S>();
  }

  /// Whether steps have made the coordinate sum so much larger than the volumes' that it should
  /// begin anew. They are some sixty times the body's size long then.
  bool needsRestart(S body_unit) const { return way_ > 64 * body_unit; }
  /// Lets the coordinate sum begin anew; `include` is to follow for every volume.
  void restart() { way_ = coordinate_sum_ = 0; }

  std::size_t bytes() const { return inflations_.capacity() * sizeof(float); }

 private:
  std::vector<float> inflations_;
  S coordinate_sum_ = 0;
  S way_ = 0;  ///< the largest displacements since `restart`, summed
};

}  // namespace adaptive_bvh
