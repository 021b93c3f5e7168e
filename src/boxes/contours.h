#pragma once

#include <cstdint>
#include <vector>

#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// The triangles below a node of a four-wide tree, and their contour.
struct Patch {
  std::uint32_t first, count;  ///< range of triangles in the order of the leaves
  /// The beginning of the contour in Contours::slots_, and its number of vertices. The length is 0
  /// if the contour is not one closed curve, or too long for a test, and for small patches.
  std::uint32_t contour, length;
};

/// The contours of the larger nodes of a four-wide tree. A contour consists of the edges of the
/// triangles below a node, except edges that two triangles share in opposite directions. Contours
/// depend on the topology only.
class Contours {
 public:
  void assign(const WideTree& tree);

  const Patch& patch(int node) const { return patches_[static_cast<std::size_t>(node)]; }
  /// The slots of the vertices along a contour, in order.
  const unsigned* slots(const Patch& patch) const { return slots_.data() + patch.contour; }

  std::size_t bytes() const {
    return patches_.capacity() * sizeof(Patch) + slots_.capacity() * sizeof(unsigned);
  }

 private:
  std::vector<Patch> patches_;   ///< by node
  std::vector<unsigned> slots_;  ///< of all contours, one after the other
};

}  // namespace adaptive_bvh
