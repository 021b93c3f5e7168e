#pragma once

#include <cstdint>
#include <vector>

#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// The triangles below a node of a four-wide tree, and the curve around them.
struct Patch {
  std::uint32_t first, count;  ///< triangles, in the order of the leaves
  /// Where its contour stands in Contours::slots, and its number of vertices; 0 where the edges
  /// that are not shared by two triangles are not one closed curve, and for few triangles.
  std::uint32_t contour, length;
};

/// The contours of the larger nodes of a four-wide tree: the edges of the triangles below, except
/// edges that two triangles share in opposite directions. They depend on the topology only.
class Contours {
 public:
  void adopt(const WideTree& tree);

  const Patch& patch(int node) const { return patches_[static_cast<std::size_t>(node)]; }
  /// The slots of the vertices along a contour, one after the other.
  const unsigned* slots(const Patch& patch) const { return slots_.data() + patch.contour; }

  std::size_t bytes() const {
    return patches_.capacity() * sizeof(Patch) + slots_.capacity() * sizeof(unsigned);
  }

 private:
  std::vector<Patch> patches_;
  std::vector<unsigned> slots_;
};

}  // namespace adaptive_bvh
