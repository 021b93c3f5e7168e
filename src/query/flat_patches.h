#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "boxes/contours.h"
#include "geometry/vectors.h"

namespace adaptive_bvh {

/// Which nodes of a four-wide tree are surely flat enough that no two triangles below intersect, of
/// those without a common vertex: seen along some direction all triangles face the viewer, and
/// their contour does not come near itself. Then they cover no point twice (Volino and
/// Magnenat-Thalmann 1994): docs/bounds.md, 14.
class FlatPatches {
 public:
  FlatPatches(const WideTree& tree, const Contours& contours)
      : tree_(tree), contours_(contours), slots_(tree.slots()) {}

  /// Of an inner node.
  bool contains(int node) const;

 private:
  /// Seen along a direction: the distance from a triangle's corner to the opposite edge is at least
  /// this share of the longest edge, and more than positions may be off by. The contour keeps as
  /// far from itself.
  static constexpr float kShare = 1.f / 64, kLeast = 64 * WideTree::kPositionError;

  /// Two directions that span the plane of view, and that at right angles to both; each four times.
  struct View {
    Vector4x3 right, up, ahead;
  };
  /// Of the triangles of a patch: the longest edge, and the smallest height as it is seen; not
  /// positive where one is seen from behind.
  struct Shape {
    float edge, height;
  };

  View viewOf(const Patch& patch) const;
  Shape shapeOf(const Patch& patch, const View& view) const;
  bool contourKeepsApart(const Patch& patch, const View& view, float distance) const;
  void read(const std::array<std::uint32_t, 4>& triangles, Vector4x3 (&corners)[3]) const;

  const WideTree& tree_;
  const Contours& contours_;
  const VertexSlots& slots_;
};

}  // namespace adaptive_bvh
