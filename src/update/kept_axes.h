#pragma once

#include <cstdint>

#include "geometry/packed_rotation.h"

// Also compiled for AVX2: see update/fit_kernels.h.
namespace adaptive_bvh {

/// What a refit needs of an inner node.
struct KeptAxes {
  std::uint64_t slots = 0;  ///< which vertices are below it, as VertexSlots::Set::bits
  /// The axes that were chosen for its volume, in a frame that three of its vertices span, so that
  /// they turn as the node does; and the volume's surface then.
  PackedRotation rotation;
  float area = 0;
  /// Instead of these, of two triangles with a common edge: its ends, and the two other corners, as
  /// offsets in the block of slots. Four equal ones where it is no such pair.
  std::uint8_t quad[4] = {0, 0, 0, 0};

  bool isQuad() const { return quad[0] != quad[1]; }
};

}  // namespace adaptive_bvh
