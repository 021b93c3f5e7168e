#pragma once

#include "geometry/float4.h"

namespace adaptive_bvh {

/// Four vectors in structure of arrays.
using Vector4x3 = float4::Columns;

namespace vectors4 {

/// A vector four times, rounded to single precision.
template <typename Vector>
ADAPTIVE_BVH_INLINE Vector4x3 all(const Vector& v) {
  return {float4::all(static_cast<float>(v[0])), float4::all(static_cast<float>(v[1])),
          float4::all(static_cast<float>(v[2]))};
}
ADAPTIVE_BVH_INLINE Vector4x3 difference(const Vector4x3& a, const Vector4x3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
ADAPTIVE_BVH_INLINE Vector4x3 sum(const Vector4x3& a, const Vector4x3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
ADAPTIVE_BVH_INLINE Vector4x3 cross(const Vector4x3& a, const Vector4x3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
ADAPTIVE_BVH_INLINE Float4 dot(const Vector4x3& a, const Vector4x3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// The largest component, without its sign.
ADAPTIVE_BVH_INLINE Float4 size(const Vector4x3& a) {
  using float4::absolute;
  using float4::upper;
  return upper(upper(absolute(a.x), absolute(a.y)), absolute(a.z));
}

}  // namespace vectors4

}  // namespace adaptive_bvh
