#pragma once

#include "geometry/packed_rotation.h"

namespace adaptive_bvh {

/// What a refit along kept axes needs of a node with three triangles or more: which vertices are
/// below it, as VertexSlots::Set::bits; the axes that were chosen for its volume, in a frame that
/// three of its vertices span, so that they turn as the node does; and the volume's surface then.
struct KeptAxes {
  std::uint64_t slots = 0;
  PackedRotation rotation;
  float area = 0;
};

}  // namespace adaptive_bvh
