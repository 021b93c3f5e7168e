#pragma once

#include <vector>

#include "query/regions/patches.h"

namespace adaptive_bvh {

/// A part of a face of each body, in one plane up to rounding, at the border of a region.
struct CoincidingFaces {
  unsigned region;
  double area;
  fcl::Vector3d normal;  ///< of the first body's face, of length 1
  bool are_alike;        ///< both faces have this normal, not opposite ones
  /// Whether the first body's face is beyond the second's, in the direction of `normal`.
  bool is_first_in_front;
};

/// Sets `found` to the common parts of the pairs in `crossings.coplanar()`. A pair of faces that
/// cross has two parts, on both sides of the crossing.
void findCoincidingFaces(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
                         SurfacePatches& patches, std::vector<CoincidingFaces>& found);

}  // namespace adaptive_bvh
