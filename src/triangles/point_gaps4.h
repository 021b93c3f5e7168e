#pragma once

#include "base/vectors.h"

namespace adaptive_bvh {

/// Lower bounds of the distances from a point to four triangles, in single precision: gaps along a
/// line from the point to each triangle, which never exceed the distance. Errors in the choice of
/// the line do not matter; only the rounding of the gap itself does, and `margin` covers it:
/// docs/bounds.md, 16.
class PointGaps4 {
 public:
  /// `corners` are relative to the point, one triangle in each lane. `error` bounds the error of
  /// their components. Keeps a reference to `corners`.
  ADAPTIVE_BVH_INLINE PointGaps4(const Vector4x3 (&corners)[3], const Float4& error)
      : corners_(corners) {
    using float4::upper;
    const Float4 size =
        upper<Float4>(upper<Float4>(vectors::size(corners[0]), vectors::size(corners[1])),
                      vectors::size(corners[2]));
    margin_ = float4::all(2) * error + float4::all(16 * kUnit) * size;
  }

  /// The gap along the line to the triangle's centroid; 0 or less if there is no gap.
  ADAPTIVE_BVH_INLINE Float4 byMiddles() const {
    return gapAlong(vectors::sum(vectors::sum(corners_[0], corners_[1]), corners_[2]));
  }
  /// The gap along the line to the triangle's nearest point.
  ADAPTIVE_BVH_INLINE Float4 byNearest() const {
    Vector4x3 edges[3];
    for (int k = 0; k < 3; ++k) edges[k] = vectors::difference(corners_[(k + 1) % 3], corners_[k]);
    Nearest nearest{float4::all(1e30f), corners_[0]};
    for (int k = 0; k < 3; ++k) considerEdge(corners_[k], edges[k], nearest);
    considerFace(edges, nearest);
    return gapAlong(nearest.vector);
  }

 private:
  static constexpr float kUnit = 1.f / (1 << 24);  // unit roundoff
  static constexpr float kLeast = 1e-30f;          // the least divisor

  /// The nearest points found so far: squared distances, and vectors from the point to them.
  struct Nearest {
    Float4 squared;
    Vector4x3 vector;

    template <typename Mask>
    ADAPTIVE_BVH_INLINE void keep(const Mask& is_nearer, const Float4& square, const Vector4x3& w) {
      squared = is_nearer ? square : squared;
      vector.x = is_nearer ? w.x : vector.x;
      vector.y = is_nearer ? w.y : vector.y;
      vector.z = is_nearer ? w.z : vector.z;
    }
  };

  /// The gap between the point and the triangle along a vector: the least projection of a corner on
  /// the unit vector, minus the margin for rounding.
  ADAPTIVE_BVH_INLINE Float4 gapAlong(const Vector4x3& vector) const {
    using float4::lower;
    const Float4 a = vectors::dot(vector, corners_[0]), b = vectors::dot(vector, corners_[1]),
                 c = vectors::dot(vector, corners_[2]);
    const Float4 squared = float4::upper<Float4>(vectors::dot(vector, vector), float4::all(kLeast));
    return lower<Float4>(lower<Float4>(a, b), c) / float4::squareRoot(squared) - margin_;
  }

  /// Considers the point of an edge nearest to the point. `from` is the edge's first corner.
  ADAPTIVE_BVH_INLINE static void considerEdge(const Vector4x3& from, const Vector4x3& edge,
                                               Nearest& nearest) {
    using float4::all;
    const Float4 squared = float4::upper<Float4>(vectors::dot(edge, edge), all(kLeast));
    const Float4 share = float4::lower<Float4>(
        float4::upper<Float4>(-vectors::dot(from, edge) / squared, all(0)), all(1));
    const Vector4x3 vector = vectors::sum(from, vectors::scaled(edge, share));
    const Float4 square = vectors::dot(vector, vector);
    nearest.keep(square < nearest.squared, square, vector);
  }
  /// Takes the projection of the point on the triangle's plane, if it is inside: it is then
  /// nearest.
  ADAPTIVE_BVH_INLINE void considerFace(const Vector4x3 (&edges)[3], Nearest& nearest) const {
    using float4::all;
    const Vector4x3 normal = vectors::cross(edges[0], edges[1]);
    const auto side = [&](int k) -> Float4 {
      return vectors::dot(vectors::cross(edges[k], normal), corners_[k]);
    };
    const Float4 inside = float4::lower<Float4>(float4::lower<Float4>(side(0), side(1)), side(2));
    const Float4 squared = float4::upper<Float4>(vectors::dot(normal, normal), all(kLeast));
    const Vector4x3 vector =
        vectors::scaled(normal, Float4(vectors::dot(normal, corners_[0]) / squared));
    nearest.keep(inside >= all(0), vectors::dot(vector, vector), vector);
  }

  const Vector4x3 (&corners_)[3];
  Float4 margin_;  ///< bound of the rounding error of a gap
};

}  // namespace adaptive_bvh
