#pragma once

#include <vector>

#include "query/regions/patches.h"

namespace adaptive_bvh {

/// Faces of both bodies that coincide in a region.
struct CoincidingFaces {
  unsigned region;
  double area;
  fcl::Vector3d normal;  ///< of the first body's face, of length 1
  bool are_alike;        ///< both face the same way
  /// Whether the first body's face lies in front of the second's.
  bool is_first_in_front;
};

/// Finds coinciding faces. Faces that coincide up to rounding are divided where they cross.
void findCoincidingFaces(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
                         SurfacePatches& patches, std::vector<CoincidingFaces>& found);

}  // namespace adaptive_bvh
