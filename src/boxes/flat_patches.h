#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "base/float4.h"
#include "base/scratch.h"
#include "base/vectors.h"
#include "boxes/contours.h"

namespace adaptive_bvh {

/// A closed polygon in the plane, and whether it keeps away from itself.
class PlaneContour {
 public:
  explicit PlaneContour(std::size_t corners);

  /// Four corners from `i` on, a multiple of four; past the last one any.
  ADAPTIVE_BVH_INLINE void setCorners(std::size_t i, const Float4& x, const Float4& y) {
    float4::store(x, &x_[i]);
    float4::store(y, &y_[i]);
  }
  /// True: every corner is at least `distance`, or at least as far as an edge is long, from each
  /// edge that does not end in it, and edges cross nowhere, up to the rounding of differences and
  /// products. Where corners lie askew it may ask for more, so false says nothing.
  bool keepsApart(float distance);

 private:
  static constexpr std::size_t kChain = 4;  ///< edges of a chain

  /// Ends of four edges, or of one edge four times.
  struct Ends {
    Float4 ax, ay, bx, by;
  };
  struct ChainBox {
    float low_x, low_y, high_x, high_y;
  };

  void close();
  bool isStar(float distance) const;
  bool neighboursKeepApart(float distance) const;
  bool edgesKeepApart(float distance) const;
  bool edgeKeepsApart(std::size_t i, std::size_t first, float least) const;
  unsigned edgesOf(std::size_t first) const;
  Ends edge(std::size_t i) const;
  Ends chain(std::size_t first) const;
  ChainBox boxOf(std::size_t first) const;
  static Float4 gapBeside(const Ends& edge, const Ends& other, const Float4& distance);

  const std::size_t corners_;
  Scratch<float> memory_;
  float *const x_, *const y_;  ///< of the corners; then the first again, which fills the last chain
};

/// Which nodes of a four-wide tree are surely flat enough that no two triangles below intersect, of
/// those without a common vertex: seen along some direction all triangles face the viewer, and
/// their contour does not come near itself. Then they cover no point twice (Volino and
/// Magnenat-Thalmann 1994): docs/bounds.md, 14.
class FlatPatches {
 public:
  FlatPatches(const WideTree& tree, const Contours& contours) : tree_(tree), contours_(contours) {}
  /// So flat that no two triangles, or edges, or a vertex and a triangle, are at most `distance`
  /// apart, of those without a common vertex.
  FlatPatches(const WideTree& tree, const Contours& contours, double distance)
      : tree_(tree), contours_(contours), wanted_(roundedUp(distance * tree.scale())) {}

  /// Whether an inner node is flat.
  bool contains(int node) const;

 private:
  /// Seen along a direction: the distance from a triangle's corner to the opposite edge is at least
  /// this share of the longest edge, and more than positions may be off by. The contour keeps as
  /// far from itself.
  static constexpr float kShare = 1.f / 64, kLeast = 64 * WideTree::kPositionError;
  /// A contour keeps at least 3/4 as far apart as was computed.
  static constexpr float kOfContour = 4.f / 3 * (1 + 1.f / (1 << 16));

  static float roundedUp(double distance) {
    constexpr double kUp = 1 + 1. / (1 << 16), kMost = 16;  // more than the coordinates
    return static_cast<float>(std::min(kUp * distance, kMost));
  }

  /// Two directions that span the plane of view, and that at right angles to both; each four times.
  struct View {
    Vector4x3 right, up, ahead;
  };
  /// Longest edge and smallest projected height of the triangles of a patch; the height is not
  /// positive if a triangle is seen from behind.
  struct Shape {
    float edge, height;
  };

  View viewOf(const Patch& patch) const;
  Shape shapeOf(const Patch& patch, const View& view) const;
  bool contourKeepsApart(const Patch& patch, const View& view, float distance) const;

  const WideTree& tree_;
  const Contours& contours_;
  const float wanted_ = 0;  ///< to keep apart in addition
};

}  // namespace adaptive_bvh
