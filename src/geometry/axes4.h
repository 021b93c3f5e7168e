#pragma once

#include "geometry/float4.h"

namespace adaptive_bvh {

/// Three orthonormal axes in single precision.
struct Axes4 {
  Float4 x{1, 0, 0, 0}, y{0, 1, 0, 0}, z{0, 0, 1, 0};

  /// In the frame of these axes: where the vector is that has these components.
  ADAPTIVE_BVH_INLINE Float4 combine(float a, float b, float c) const {
    return x * float4::all(a) + y * float4::all(b) + z * float4::all(c);
  }
  /// The other axes' components along these.
  ADAPTIVE_BVH_INLINE Axes4 components(const Axes4& other) const {
    const float4::Columns c = float4::columns(x, y, z, z);
    const auto along = [&](const Float4& v) -> Float4 {
      return c.x * float4::all(v[0]) + c.y * float4::all(v[1]) + c.z * float4::all(v[2]);
    };
    return {along(other.x), along(other.y), along(other.z)};
  }
  /// Axes whose components along these are given.
  ADAPTIVE_BVH_INLINE Axes4 operator*(const Axes4& components) const {
    const auto from = [&](const Float4& v) -> Float4 { return combine(v[0], v[1], v[2]); };
    return {from(components.x), from(components.y), from(components.z)};
  }
  /// Turned in the plane of x and y, by an angle given as a unit vector.
  ADAPTIVE_BVH_INLINE Axes4 turned(float cosine, float sine) const {
    return {x * float4::all(cosine) + y * float4::all(sine),
            y * float4::all(cosine) - x * float4::all(sine), z};
  }
};

/// Right-handed axes, the first along a, the third orthogonal to a and b; those of the coordinates
/// where a and b are parallel or 0.
ADAPTIVE_BVH_INLINE Axes4 axesAlong(const Float4& a, const Float4& b) {
  constexpr float kTiny = 1e-30f;
  const Float4 normal = float4::cross(a, b);
  const Float4 squares = float4::sums(a * a, normal * normal, a * a, a * a);
  if (!(squares[0] > kTiny && squares[1] > kTiny)) return {};
  const Float4 scales = float4::all(1) / float4::squareRoot(squares);
  Axes4 axes;
  axes.x = a * float4::all(scales[0]);
  axes.z = normal * float4::all(scales[1]);
  axes.y = float4::cross(axes.z, axes.x);
  return axes;
}

}  // namespace adaptive_bvh
