#pragma once

#include <array>

#include <fcl/common/types.h>

#include "triangles/feature_distance.h"

namespace adaptive_bvh {

/// The square of a point's distance to the corner, the line of the side or the plane of a face on
/// which its nearest point lies, with twice the digits of a double: to tell faces that are exactly
/// as near from others. docs/bounds.md, 16.
class PreciseSquare {
 public:
  /// `at`: where the nearest point lies. `scale`: a power of two, the unit of the distance; it
  /// should bring the distance to about 1.
  PreciseSquare(const fcl::Vector3d& x, const std::array<fcl::Vector3d, 3>& face,
                const feature_distance::FacePlace<double>& at, double scale);

  /// Whether it is certainly less: by more than what is rounded in both.
  bool isLess(const PreciseSquare& other) const;

 private:
  double high_, low_;  ///< their sum, unevaluated
};

}  // namespace adaptive_bvh
