#pragma once

#include "geometry/vectors.h"

namespace adaptive_bvh {

/// What is near up to four triangles, between two planes across the sum of their normals: on a
/// smooth surface they lie in a thin slab. In single precision. docs/bounds.md, 16.
class LeafSlab {
 public:
  LeafSlab() = default;
  /// Lanes without a triangle repeat another. `error`: of a component of a corner, none of which is
  /// 2 or more.
  ADAPTIVE_BVH_INLINE LeafSlab(const Vector4x3 (&corners)[3], float distance, float error) {
    const Vector4x3 normals = vectors::cross(vectors::difference(corners[1], corners[0]),
                                             vectors::difference(corners[2], corners[0]));
    const Vector4x3 first = {float4::broadcast<0>(normals.x), float4::broadcast<0>(normals.y),
                             float4::broadcast<0>(normals.z)};
    const auto faces_back = vectors::dot(normals, first) < float4::all(0);
    const auto sum = [&](const Float4& v) -> Float4 {
      return float4::all(packs::sum(faces_back ? -v : v));
    };
    normal_ = {sum(normals.x), sum(normals.y), sum(normals.z)};
    const Float4 size =
        float4::absolute(normal_.x) + float4::absolute(normal_.y) + float4::absolute(normal_.z);
    const Float4 length = float4::squareRoot(vectors::dot(normal_, normal_));
    const Float4 margin =
        (length * float4::all(kUp) + float4::all(kLeast)) * float4::all(distance * kUp) +
        size * float4::all(4 * error + 48 * kUnit) + float4::all(1e-30f);
    const Range range = along(corners);
    below_ = float4::all(packs::smallest(range.low)) - margin;
    above_ = float4::all(packs::largest(range.high)) + margin;
  }

  /// Which of four other triangles are surely farther than the distance from all of these.
  ADAPTIVE_BVH_INLINE unsigned apart(const Vector4x3 (&corners)[3]) const {
    const Range range = along(corners);
    return float4::bits((range.low > above_) | (range.high < below_));
  }

 private:
  static constexpr float kUnit = 1.f / (1 << 24), kUp = 1 + 1.f / (1 << 20);
  static constexpr float kLeast = 1e-18f;  // more than a length whose square underflows

  struct Range {
    Float4 low, high;
  };
  ADAPTIVE_BVH_INLINE Range along(const Vector4x3 (&corners)[3]) const {
    using float4::lower;
    using float4::upper;
    using vectors::dot;
    const Float4 a = dot(normal_, corners[0]), b = dot(normal_, corners[1]),
                 c = dot(normal_, corners[2]);
    return {lower<Float4>(lower<Float4>(a, b), c), upper<Float4>(upper<Float4>(a, b), c)};
  }

  Vector4x3 normal_;
  Float4 below_, above_;
};

}  // namespace adaptive_bvh
