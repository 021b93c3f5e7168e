#pragma once

#include <limits>

#include "geometry/vectors.h"

namespace adaptive_bvh {

/// What the numbers of TrianglePairs4 may be off by, beside their rounding.
struct PairError {
  float position;  ///< of a component of a corner
  float share;     ///< as above, as a share of the extent of the pair
  float least;     ///< of a product: for numbers too small for FCL's test, or for this one
};

/// What FCL's test says of four pairs of triangles, where that is certain; a bit for each.
struct Verdicts4 {
  unsigned apart, touching;
};

/// Four pairs of triangles p and q, as FCL's test looks at them. It projects both on seventeen axes
/// (the normals, the products of an edge of p and one of q, the products of edges and normals), and
/// says that they are apart where their projections on one axis are. The same axes are tried here,
/// in single precision: where the gap of two projections is larger than all that both computations
/// can be off by, FCL finds a gap, too; where they overlap by more than that on every axis, FCL
/// finds no gap. docs/bounds.md, 13.
class TrianglePairs4 {
 public:
  Vector4x3 p_edges[3], q_edges[3];  ///< k: from corner k to the next
  Vector4x3 q[3];                    ///< corners, from the first corner of p

  TrianglePairs4() = default;
  ADAPTIVE_BVH_INLINE TrianglePairs4(const Vector4x3 (&p_corners)[3],
                                     const Vector4x3 (&q_corners)[3]) {
    for (int k = 0; k < 3; ++k) {
      p_edges[k] = vectors::difference(p_corners[(k + 1) % 3], p_corners[k]);
      q_edges[k] = vectors::difference(q_corners[(k + 1) % 3], q_corners[k]);
      q[k] = vectors::difference(q_corners[k], p_corners[0]);
    }
  }

  /// From corners in two numbers each, the second being what the first was rounded by.
  ADAPTIVE_BVH_INLINE TrianglePairs4(const Vector4x3 (&p_corners)[3],
                                     const Vector4x3 (&p_residuals)[3],
                                     const Vector4x3 (&q_corners)[3],
                                     const Vector4x3 (&q_residuals)[3])
      : TrianglePairs4(p_corners, q_corners) {
    const TrianglePairs4 lost(p_residuals, q_residuals);
    for (int k = 0; k < 3; ++k) {
      p_edges[k] = vectors::sum(p_edges[k], lost.p_edges[k]);
      q_edges[k] = vectors::sum(q_edges[k], lost.q_edges[k]);
      q[k] = vectors::sum(q[k], lost.q[k]);
    }
  }

  /// Which are apart along the normal of either: that leaves few.
  ADAPTIVE_BVH_INLINE unsigned apartByPlanes(const PairError& error) const {
    const Sizes sizes(*this, error);
    return float4::bits(
        (gapAlongP(vectors::cross(p_edges[0], p_edges[1])) > sizes.margin(sizes.p)) |
        (gapAlongQ(vectors::cross(q_edges[0], q_edges[1])) > sizes.margin(sizes.q)));
  }

  /// Which are apart in the plane of either, at right angles to one of its edges: triangles side by
  /// side on a smooth surface.
  ADAPTIVE_BVH_INLINE unsigned apartByEdgeNormals(const PairError& error) const {
    const Sizes sizes(*this, error);
    const Vector4x3 p_normal = vectors::cross(p_edges[0], p_edges[1]);
    const Vector4x3 q_normal = vectors::cross(q_edges[0], q_edges[1]);
    const Float4 p_margin = sizes.marginOfThree(sizes.p), q_margin = sizes.marginOfThree(sizes.q);
    Float4 apart = float4::all(std::numeric_limits<float>::lowest());
    for (int i = 0; i < 3; ++i) {
      const Float4 p_gap = gap(vectors::cross(p_edges[i], p_normal)) - p_margin;
      const Float4 q_gap = gap(vectors::cross(q_edges[i], q_normal)) - q_margin;
      apart = float4::upper(apart, float4::upper(p_gap, q_gap));
    }
    return float4::bits(apart > float4::all(0));
  }

  /// By all axes.
  ADAPTIVE_BVH_INLINE Verdicts4 verdicts(const PairError& error) const {
    using float4::all;
    using float4::upper;
    using vectors::cross;
    const Sizes sizes(*this, error);
    const Vector4x3 p_normal = cross(p_edges[0], p_edges[1]);
    const Vector4x3 q_normal = cross(q_edges[0], q_edges[1]);
    // The largest of all gaps, less and plus its margin.
    Float4 low = all(std::numeric_limits<float>::lowest()), high = low;
    const auto add = [&](const Float4& gap, const Float4& margin) {
      low = upper<Float4>(low, gap - margin);
      high = upper<Float4>(high, gap + margin);
    };
    add(gapAlongP(p_normal), sizes.margin(sizes.p));
    add(gapAlongQ(q_normal), sizes.margin(sizes.q));
    const Float4 p_margin = sizes.marginOfThree(sizes.p), q_margin = sizes.marginOfThree(sizes.q);
    for (int i = 0; i < 3; ++i) {
      add(gap(cross(p_edges[i], p_normal)), p_margin);
      add(gap(cross(q_edges[i], q_normal)), q_margin);
    }
    const Float4 margin = sizes.margin(upper(sizes.p, sizes.q));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) add(gap(cross(p_edges[i], q_edges[j])), margin);
    const Float4 zero = all(0);
    const unsigned solid = float4::bits((vectors::size(p_normal) > sizes.p * sizes.p * all(kThin)) &
                                        (vectors::size(q_normal) > sizes.q * sizes.q * all(kThin)));
    return {float4::bits(low > zero), float4::bits(high < zero) & solid};
  }

 private:
  /// Triangles that are surely not thin (triangle_contact.h): of these FCL's test alone decides.
  static constexpr float kThin = 1.f / (1 << 9);

  /// Of the two triangles and of both together, at least; and what products of these are off by.
  struct Sizes {
    ADAPTIVE_BVH_INLINE Sizes(const TrianglePairs4& pairs, const PairError& e) {
      using float4::all;
      p = largest(pairs.p_edges);
      q = largest(pairs.q_edges);
      extent = largest(pairs.q) + p + q;
      position = all(e.position) + extent * all(e.share);
      const Float4 slack = position * all(4);
      p += slack;
      q += slack;
      extent += slack + slack + slack;
      least = all(e.least);
    }
    /// Of a gap along the product of two edges of this size.
    ADAPTIVE_BVH_INLINE Float4 margin(const Float4& edge) const {
      return edge * extent * (position * float4::all(80) + edge * float4::all(256 * kUnit)) + least;
    }
    /// Along the product of three.
    ADAPTIVE_BVH_INLINE Float4 marginOfThree(const Float4& edge) const {
      return edge * edge * extent *
                 (position * float4::all(208) + edge * float4::all(640 * kUnit)) +
             least;
    }
    Float4 p, q, extent, position, least;

   private:
    static constexpr float kUnit = 1.f / (1 << 24);
    ADAPTIVE_BVH_INLINE static Float4 largest(const Vector4x3 (&v)[3]) {
      return float4::upper(float4::upper(vectors::size(v[0]), vectors::size(v[1])),
                           vectors::size(v[2]));
    }
  };

  struct Range {
    Float4 low, high;
  };
  ADAPTIVE_BVH_INLINE static Range range(const Float4& a, const Float4& b, const Float4& c) {
    using float4::lower;
    using float4::upper;
    return {lower(lower(a, b), c), upper(upper(a, b), c)};
  }
  ADAPTIVE_BVH_INLINE static Float4 gap(const Range& a, const Range& b) {
    return float4::upper<Float4>(a.low - b.high, b.low - a.high);
  }
  ADAPTIVE_BVH_INLINE Range pAlong(const Vector4x3& axis) const {
    return range(float4::all(0), vectors::dot(axis, p_edges[0]), -vectors::dot(axis, p_edges[2]));
  }
  ADAPTIVE_BVH_INLINE Range qAlong(const Vector4x3& axis) const {
    return range(vectors::dot(axis, q[0]), vectors::dot(axis, q[1]), vectors::dot(axis, q[2]));
  }
  ADAPTIVE_BVH_INLINE Float4 gap(const Vector4x3& axis) const {
    return gap(pAlong(axis), qAlong(axis));
  }
  /// Along the normal of p, or of q, on which that triangle is one point.
  ADAPTIVE_BVH_INLINE Float4 gapAlongP(const Vector4x3& normal) const {
    return gap({float4::all(0), float4::all(0)}, qAlong(normal));
  }
  ADAPTIVE_BVH_INLINE Float4 gapAlongQ(const Vector4x3& normal) const {
    const Float4 point = vectors::dot(normal, q[0]);
    return gap(pAlong(normal), {point, point});
  }
};

}  // namespace adaptive_bvh
