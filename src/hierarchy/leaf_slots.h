#pragma once

#include <cstdint>

#include "base/pack.h"

namespace adaptive_bvh {

/// The slots of the three vertices of a leaf's triangle: see VertexSlots.
struct LeafSlots {
  unsigned block;          ///< first slot of the leaf's block
  std::uint8_t offset[3];  ///< offset of each vertex's slot from `block`

  ADAPTIVE_BVH_INLINE unsigned slot(int corner) const { return block + offset[corner]; }
  /// The set of the three slots: bit i stands for slot block + i.
  ADAPTIVE_BVH_INLINE std::uint64_t bits() const {
    constexpr std::uint64_t kOne = 1;
    return kOne << (offset[0] & 63) | kOne << (offset[1] & 63) | kOne << (offset[2] & 63);
  }
};

}  // namespace adaptive_bvh
