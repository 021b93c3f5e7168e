#pragma once

#include <cstdint>
#include <vector>

#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// The triangles below a node of a four-wide tree, and their contour.
struct Patch {
  std::uint32_t first, count;  ///< range of triangles in the order of the leaves
  /// The beginning of its contour in Contours::slots, and its number of vertices. Length 0 if the
  /// edges that are not shared by two triangles do not form one closed curve, and for small
  /// patches.
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
  std::vector<Patch> patches_;
  std::vector<unsigned> slots_;
};

}  // namespace adaptive_bvh
