#pragma once

#include <limits>

#include "base/vectors.h"

namespace adaptive_bvh {

/// Errors of the input of PackedTrianglePairs, in addition to rounding.
struct PairError {
  float position;  ///< error of a component of a corner
  float share;     ///< error of a component, relative to the extent of the pair
  float least;     ///< error of a product by underflow, in FCL's test and in this one
  /// Not an error: pairs count as apart if they are farther apart than this, 0 or more.
  float distance = 0;
};

/// The pairs of triangles that FCL's test certainly reports apart or touching; a bit for each pair.
/// A pair may be in neither.
struct PairVerdicts {
  unsigned apart, touching;
};

/// Pairs of triangles p and q, one in each lane of the pack P, tested like FCL tests them. FCL
/// projects both triangles on seventeen axes (the normals, the cross products of an edge of p and
/// one of q, the cross products of edges and normals), and reports them apart if their projections
/// on one axis are disjoint. This class tries the same axes in single precision. If the gap of two
/// projections exceeds the errors of both computations, FCL finds a gap, too; if they overlap by
/// more than the errors on every axis, FCL finds no gap. docs/bounds.md, 13.
template <typename P>
class PackedTrianglePairs {
 public:
  using Vector = Vectors<P>;

  Vector p_edges[3], q_edges[3];  ///< edge k runs from corner k to the next
  Vector q[3];                    ///< corners relative to the first corner of p

  PackedTrianglePairs() = default;
  ADAPTIVE_BVH_INLINE PackedTrianglePairs(const Vector (&p_corners)[3],
                                          const Vector (&q_corners)[3]) {
    for (int k = 0; k < 3; ++k) {
      p_edges[k] = vectors::difference(p_corners[(k + 1) % 3], p_corners[k]);
      q_edges[k] = vectors::difference(q_corners[(k + 1) % 3], q_corners[k]);
      q[k] = vectors::difference(q_corners[k], p_corners[0]);
    }
  }

  /// From corners as sums of two numbers: the residual is the rounding error of the first number.
  ADAPTIVE_BVH_INLINE PackedTrianglePairs(const Vector (&p_corners)[3],
                                          const Vector (&p_residuals)[3],
                                          const Vector (&q_corners)[3],
                                          const Vector (&q_residuals)[3])
      : PackedTrianglePairs(p_corners, q_corners) {
    const PackedTrianglePairs residuals(p_residuals, q_residuals);
    for (int k = 0; k < 3; ++k) {
      p_edges[k] = vectors::sum(p_edges[k], residuals.p_edges[k]);
      q_edges[k] = vectors::sum(q_edges[k], residuals.q_edges[k]);
      q[k] = vectors::sum(q[k], residuals.q[k]);
    }
  }

  /// A bit for each pair that is apart along the normal of p or q. Few pairs remain.
  ADAPTIVE_BVH_INLINE unsigned apartByPlanes(const PairError& error) const {
    const Sizes sizes(*this, error);
    const Vector p_normal = vectors::cross(p_edges[0], p_edges[1]);
    const Vector q_normal = vectors::cross(q_edges[0], q_edges[1]);
    return packs::bits(
        (gapAlongP(p_normal) > sizes.margin(sizes.p) + sizes.distanceAlong(p_normal)) |
        (gapAlongQ(q_normal) > sizes.margin(sizes.q) + sizes.distanceAlong(q_normal)));
  }

  /// A bit for each pair that is apart along a direction in the plane of p or q, perpendicular to
  /// one of its edges: finds triangles side by side on a smooth surface.
  ADAPTIVE_BVH_INLINE unsigned apartByEdgeNormals(const PairError& error) const {
    const Sizes sizes(*this, error);
    const Vector p_normal = vectors::cross(p_edges[0], p_edges[1]);
    const Vector q_normal = vectors::cross(q_edges[0], q_edges[1]);
    const P p_margin = sizes.marginOfThree(sizes.p), q_margin = sizes.marginOfThree(sizes.q);
    P apart = packs::filled<P>(kLowest);
    for (int i = 0; i < 3; ++i) {
      const Vector p_axis = vectors::cross(p_edges[i], p_normal);
      const Vector q_axis = vectors::cross(q_edges[i], q_normal);
      const P p_gap = gap(p_axis) - (p_margin + sizes.distanceAlong(p_axis));
      const P q_gap = gap(q_axis) - (q_margin + sizes.distanceAlong(q_axis));
      apart = packs::upper(apart, packs::upper(p_gap, q_gap));
    }
    return packs::bits(apart > packs::filled<P>(0));
  }

  /// The verdicts by all axes.
  ADAPTIVE_BVH_INLINE PairVerdicts verdicts(const PairError& error) const {
    using packs::upper;
    using vectors::cross;
    const Sizes sizes(*this, error);
    const Vector p_normal = cross(p_edges[0], p_edges[1]);
    const Vector q_normal = cross(q_edges[0], q_edges[1]);
    // The largest of all gaps, minus its margin (and the distance) and plus its margin.
    P low = packs::filled<P>(kLowest), high = low;
    const auto add = [&](const P& gap, const P& margin, const Vector& axis) {
      low = upper<P>(low, gap - (margin + sizes.distanceAlong(axis)));
      high = upper<P>(high, gap + margin);
    };
    const auto addAxis = [&](const Vector& axis, const P& margin) { add(gap(axis), margin, axis); };
    add(gapAlongP(p_normal), sizes.margin(sizes.p), p_normal);
    add(gapAlongQ(q_normal), sizes.margin(sizes.q), q_normal);
    const P p_margin = sizes.marginOfThree(sizes.p), q_margin = sizes.marginOfThree(sizes.q);
    for (int i = 0; i < 3; ++i) {
      addAxis(cross(p_edges[i], p_normal), p_margin);
      addAxis(cross(q_edges[i], q_normal), q_margin);
    }
    const P margin = sizes.margin(upper(sizes.p, sizes.q));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) addAxis(cross(p_edges[i], q_edges[j]), margin);
    const P zero = packs::filled<P>(0);
    const unsigned are_not_thin =
        packs::bits((vectors::size(p_normal) > sizes.p * sizes.p * packs::filled<P>(kThin)) &
                    (vectors::size(q_normal) > sizes.q * sizes.q * packs::filled<P>(kThin)));
    return {packs::bits(low > zero), packs::bits(high < zero) & are_not_thin};
  }

 private:
  static constexpr float kLowest = std::numeric_limits<float>::lowest();
  /// Lower bound of a normal's size, relative to the edges, for a triangle that is certainly not
  /// thin (triangle_contact.h). For pairs of such triangles FCL's test alone decides.
  static constexpr float kThin = 1.f / (1 << 9);

  /// Bounds of the components of the edges of p, of the edges of q, and of all differences of two
  /// corners (`extent`), input errors included; and the errors of products of these.
  struct Sizes {
    ADAPTIVE_BVH_INLINE Sizes(const PackedTrianglePairs& pairs, const PairError& e) {
      p = largest(pairs.p_edges);
      q = largest(pairs.q_edges);
      extent = largest(pairs.q) + p + q;
      position = packs::filled<P>(e.position) + extent * packs::filled<P>(e.share);
      const P slack = position * packs::filled<P>(4);
      p += slack;
      q += slack;
      extent += slack + slack + slack;
      least = packs::filled<P>(e.least);
      distance = e.distance;
    }
    /// The error of a gap along the product of two edges of this size.
    ADAPTIVE_BVH_INLINE P margin(const P& edge) const {
      return edge * extent *
                 (position * packs::filled<P>(80) + edge * packs::filled<P>(256 * kUnit)) +
             least;
    }
    /// The error of a gap along the product of three edges.
    ADAPTIVE_BVH_INLINE P marginOfThree(const P& edge) const {
      return edge * edge * extent *
                 (position * packs::filled<P>(208) + edge * packs::filled<P>(640 * kUnit)) +
             least;
    }
    /// The gap that the projections on `axis` have if the triangles are `distance` apart along it,
    /// rounded up, with room for squares that underflow.
    ADAPTIVE_BVH_INLINE P distanceAlong(const Vector& axis) const {
      if (!(distance > 0)) return packs::filled<P>(0);
      const P length = packs::squareRoot(vectors::dot(axis, axis));
      return packs::filled<P>(distance) *
             (length * packs::filled<P>(1 + 1.f / (1 << 20)) + packs::filled<P>(1e-18f));
    }
    P p, q, extent, position, least;
    float distance;

   private:
    static constexpr float kUnit = 1.f / (1 << 24);
    ADAPTIVE_BVH_INLINE static P largest(const Vector (&v)[3]) {
      return packs::upper(packs::upper(vectors::size(v[0]), vectors::size(v[1])),
                          vectors::size(v[2]));
    }
  };

  struct Range {
    P low, high;
  };
  /// The smallest range that contains three numbers.
  ADAPTIVE_BVH_INLINE static Range range(const P& a, const P& b, const P& c) {
    using packs::lower;
    using packs::upper;
    return {lower(lower(a, b), c), upper(upper(a, b), c)};
  }
  /// The gap of two ranges; minus their overlap if they overlap.
  ADAPTIVE_BVH_INLINE static P gap(const Range& a, const Range& b) {
    return packs::upper<P>(a.low - b.high, b.low - a.high);
  }
  /// The projections of p and of q on an axis, relative to the first corner of p.
  ADAPTIVE_BVH_INLINE Range pAlong(const Vector& axis) const {
    return range(packs::filled<P>(0), vectors::dot(axis, p_edges[0]),
                 -vectors::dot(axis, p_edges[2]));
  }
  ADAPTIVE_BVH_INLINE Range qAlong(const Vector& axis) const {
    return range(vectors::dot(axis, q[0]), vectors::dot(axis, q[1]), vectors::dot(axis, q[2]));
  }
  ADAPTIVE_BVH_INLINE P gap(const Vector& axis) const { return gap(pAlong(axis), qAlong(axis)); }
  /// The gap along the normal of p or of q; the triangle itself projects on it to one point.
  ADAPTIVE_BVH_INLINE P gapAlongP(const Vector& normal) const {
    return gap({packs::filled<P>(0), packs::filled<P>(0)}, qAlong(normal));
  }
  ADAPTIVE_BVH_INLINE P gapAlongQ(const Vector& normal) const {
    const P point = vectors::dot(normal, q[0]);
    return gap(pAlong(normal), {point, point});
  }
};

using TrianglePairs4 = PackedTrianglePairs<Float4>;

}  // namespace adaptive_bvh
