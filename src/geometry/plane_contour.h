#pragma once

#include "geometry/float4.h"
#include "geometry/scratch.h"

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
  /// True: every corner is at least `distance` from each edge that does not end in it, and edges
  /// cross nowhere, up to the rounding of differences and products. Where corners lie askew it may
  /// ask for more, so false says nothing. No edge may be shorter than `distance`.
  bool keepsApart(float distance);

 private:
  static constexpr std::size_t kChain = 4;  ///< edges of a chain

  /// Of edges: four, or one four times.
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

}  // namespace adaptive_bvh
