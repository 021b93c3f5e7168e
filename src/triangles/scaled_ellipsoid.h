#pragma once

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// A point and an ellipsoid with its axes along the coordinates, in numbers that no size and no
/// ratio of the radii makes imprecise.
struct ScaledEllipsoid {
  int shortest;             ///< axis
  fcl::Vector3d z;          ///< the point's distances from the middle, each by the radius there
  fcl::Vector3d r, excess;  ///< squares of the radii, by that of the shortest; less 1

  ScaledEllipsoid(const fcl::Vector3d& x, const fcl::Vector3d& radii) {
    const double least = radii.minCoeff(&shortest);
    z = x.cwiseAbs().cwiseQuotient(radii);
    for (int k = 0; k < 3; ++k) {
      r[k] = (radii[k] / least) * (radii[k] / least);
      excess[k] = (radii[k] - least) / least * ((radii[k] + least) / least);
    }
  }
};

}  // namespace adaptive_bvh
