#pragma once

#include "base/float4.h"

namespace adaptive_bvh {

/// Four 3D vectors in single precision, one in each lane.
using Vector4x3 = Vectors<Float4>;

/// Arithmetic of packed vectors, separately in each lane.
namespace vectors {

/// Repeats a vector four times, rounded to single precision.
template <typename Vector>
ADAPTIVE_BVH_INLINE Vector4x3 all(const Vector& v) {
  return {float4::all(static_cast<float>(v[0])), float4::all(static_cast<float>(v[1])),
          float4::all(static_cast<float>(v[2]))};
}
template <typename P>
ADAPTIVE_BVH_INLINE Vectors<P> difference(const Vectors<P>& a, const Vectors<P>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <typename P>
ADAPTIVE_BVH_INLINE Vectors<P> sum(const Vectors<P>& a, const Vectors<P>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename P>
ADAPTIVE_BVH_INLINE Vectors<P> scaled(const Vectors<P>& a, const P& by) {
  return {a.x * by, a.y * by, a.z * by};
}
template <typename P>
ADAPTIVE_BVH_INLINE Vectors<P> cross(const Vectors<P>& a, const Vectors<P>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename P>
ADAPTIVE_BVH_INLINE P dot(const Vectors<P>& a, const Vectors<P>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// The largest absolute value of the three components.
template <typename P>
ADAPTIVE_BVH_INLINE P size(const Vectors<P>& a) {
  using packs::absolute;
  using packs::upper;
  return upper(upper(absolute(a.x), absolute(a.y)), absolute(a.z));
}

}  // namespace vectors

}  // namespace adaptive_bvh
