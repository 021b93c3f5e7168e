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

/// A closed polygon in the plane, to be tested for near self-contact.
class PlaneContour {
 public:
  explicit PlaneContour(std::size_t corners);

  /// Sets corners i to i + 3; i is a multiple of four. Corners past the last one may be anything.
  ADAPTIVE_BVH_INLINE void setCorners(std::size_t i, const Float4& x, const Float4& y) {
    float4::store(x, &x_[i]);
    float4::store(y, &y_[i]);
  }
  /// Returns true only if no edges cross, and every corner is at least `distance`, or at least an
  /// edge length, from each edge that does not end at it, up to the rounding of differences and
  /// products. The test is conservative for corners with oblique angles, so false does not prove
  /// the contrary.
  bool keepsApart(float distance);

 private:
  static constexpr std::size_t kChain = 4;  ///< a chain consists of this many consecutive edges

  /// The ends a and b of four edges, or of one edge repeated four times.
  struct Ends {
    Float4 ax, ay, bx, by;
  };
  struct ChainBox {
    float low_x, low_y, high_x, high_y;
  };

  /// Writes the first corner behind the last one, and into the padding.
  void close();
  bool isStar(float distance) const;
  bool neighboursKeepApart(float distance) const;
  bool edgesKeepApart(float distance) const;
  bool edgeKeepsApart(std::size_t i, std::size_t first, float least) const;
  unsigned edgesOf(std::size_t first) const;
  Ends edge(std::size_t i) const;
  Ends chain(std::size_t first) const;  ///< the chain that begins at corner `first`
  ChainBox boxOf(std::size_t first) const;
  static Float4 gapBeside(const Ends& edge, const Ends& other, const Float4& distance);

  const std::size_t corners_;
  Scratch<float> memory_;
  /// Coordinates of the corners; then the first corner again, which also fills up the last chain.
  float *const x_, *const y_;
};

/// Finds nodes of a four-wide tree that are certainly so flat that no two triangles below them
/// intersect, apart from triangles with a common vertex. In such a node, all triangles face the
/// viewer along some direction, and their contour does not come near itself. Then the projected
/// triangles cover no point twice (Volino and Magnenat-Thalmann 1994): docs/bounds.md, 14.
class FlatPatches {
 public:
  FlatPatches(const WideTree& tree, const Contours& contours) : tree_(tree), contours_(contours) {}
  /// Finds nodes so flat that no two triangles, no two edges, and no vertex and triangle below are
  /// within `distance` of each other, apart from features with a common vertex.
  FlatPatches(const WideTree& tree, const Contours& contours, double distance)
      : tree_(tree), contours_(contours), distance_(roundedUp(distance * tree.scale())) {}

  /// Whether an inner node is certainly flat.
  bool contains(int node) const;

 private:
  /// In projection, the distance from a triangle's corner to the opposite edge must be at least
  /// this share of the longest edge, and exceed the errors of positions. The contour must keep the
  /// same distance from itself.
  static constexpr float kShare = 1.f / 64, kLeast = 64 * WideTree::kPositionError;
  /// The true distance of a contour from itself is at least 3/4 of the computed one.
  static constexpr float kContourFactor = 4.f / 3 * (1 + 1.f / (1 << 16));

  static float roundedUp(double distance) {
    constexpr double kUp = 1 + 1. / (1 << 16), kMost = 16;  // exceeds all coordinates
    return static_cast<float>(std::min(kUp * distance, kMost));
  }

  /// Two directions that span the image plane, and the viewing direction perpendicular to both;
  /// each repeated four times.
  struct View {
    Vector4x3 right, up, ahead;
  };
  /// The longest edge and smallest projected height of a patch's triangles; the height is not
  /// positive if a triangle faces away.
  struct Shape {
    float edge, height;
  };

  View viewOf(const Patch& patch) const;
  Shape shapeOf(const Patch& patch, const View& view) const;
  bool contourKeepsApart(const Patch& patch, const View& view, float distance) const;

  const WideTree& tree_;
  const Contours& contours_;
  const float distance_ = 0;  ///< additional distance to keep, in the tree's coordinates
};

}  // namespace adaptive_bvh
