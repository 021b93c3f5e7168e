#pragma once

#include <vector>

#include "query/regions/patches.h"

namespace adaptive_bvh {

/// Where faces of both bodies coincide in a region.
struct CoincidingFaces {
  unsigned region;
  double area;
  fcl::Vector3d normal;  ///< of the first's face, of length 1
  bool are_alike;        ///< both face the same way
  /// Whether the first's face lies on that side of the second's to which it faces.
  bool is_first_in_front;
};

/// Finds them. Faces that coincide up to rounding are divided where they cross.
void findCoincidingFaces(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
                         SurfacePatches& patches, std::vector<CoincidingFaces>& found);

}  // namespace adaptive_bvh
