#pragma once

#include <array>

#include <fcl/common/types.h>

#include "triangles/feature_distance.h"

namespace adaptive_bvh {

/// The squared distance of a point to the feature of a face on which its nearest point lies (a
/// corner, the line of a side, or the plane), with twice the digits of a double. Decides whether
/// two faces are equally near. docs/bounds.md, 16.
class PreciseSquare {
 public:
  /// `place` is that of the nearest point of the face. Distances are multiplied by `scale`, a power
  /// of two; choose it so that the scaled distance is about 1, the same for faces to compare.
  PreciseSquare(const fcl::Vector3d& x, const std::array<fcl::Vector3d, 3>& face,
                const feature_distance::FacePlace& place, double scale);

  /// Whether this square is less than `other` by more than the rounding errors of both.
  bool isLess(const PreciseSquare& other) const;

 private:
  double high_, low_;  ///< their sum, unevaluated
};

}  // namespace adaptive_bvh
