#pragma once

#include <vector>

#include "query/regions/patches.h"

namespace adaptive_bvh {

/// The common part of two faces, one of each body, that lie in one plane up to rounding. Rounding
/// decides which of them is the border of a region of contact there; so the region's normal leaves
/// both out.
struct CoincidingFaces {
  unsigned region;  ///< the region of contact whose border has this part
  double area;
  fcl::Vector3d normal;  ///< of the first body's face, of length 1
  bool are_alike;        ///< both faces have this normal, not opposite ones
  /// Whether the first body's face is beyond the second's, in the direction of `normal`.
  bool is_first_in_front;
};

/// Sets `found` to the common parts of the pairs in `crossings.coplanar()`. The planes of two faces
/// may differ by rounding and cross in a line; then the part in which the first face is in front
/// and the part in which it is behind are two entries. `patches` finds the region of a part, by the
/// patch of either surface there; a part without a region is left out.
void findCoincidingFaces(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
                         SurfacePatches& patches, std::vector<CoincidingFaces>& found);

}  // namespace adaptive_bvh
