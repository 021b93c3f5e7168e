#pragma once

#include <cmath>

#include "geometry/float4.h"

namespace adaptive_bvh {

/// Three orthonormal axes in single precision.
struct Axes4 {
  Float4 x{1, 0, 0, 0}, y{0, 1, 0, 0}, z{0, 0, 1, 0};

  /// In the frame of these axes: where the vector is that has these components.
  ADAPTIVE_BVH_INLINE Float4 combine(float a, float b, float c) const {
    return x * float4::all(a) + y * float4::all(b) + z * float4::all(c);
  }
  /// Of some vectors along these axes.
  class Components {
   public:
    ADAPTIVE_BVH_INLINE explicit Components(const Axes4& axes)
        : rows_(float4::columns(axes.x, axes.y, axes.z, axes.z)) {}
    ADAPTIVE_BVH_INLINE Float4 operator()(const Float4& v) const {
      return rows_.x * float4::all(v[0]) + rows_.y * float4::all(v[1]) +
             rows_.z * float4::all(v[2]);
    }

   private:
    const float4::Columns rows_;
  };
  /// The other axes' components along these.
  ADAPTIVE_BVH_INLINE Axes4 components(const Axes4& other) const {
    const Components along(*this);
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

/// A vector of length 1 that is orthogonal to a given one of length 1.
inline Float4 anyOrthogonal(const Float4& x) {
  const Float4 other = std::abs(x[0]) < 0.6f ? Float4{1, 0, 0, 0} : Float4{0, 1, 0, 0};
  const Float4 y = float4::cross(x, other);
  return y * float4::all(1 / std::sqrt(float4::dot(y, y)));
}

/// Right-handed axes, the first along a, the third orthogonal to a and b; any where a and b leave
/// the choice open. Orthonormal up to 27 * 2^-24, also where a and b are nearly parallel: the
/// product of these is then off, and with it the length of the second axis. docs/bounds.md, 11.
ADAPTIVE_BVH_INLINE Axes4 axesAlong(const Float4& a, const Float4& b) {
  constexpr float kTiny = 1e-30f, kNoise = 0.005f;
  const Float4 normal = float4::cross(a, b);
  const Float4 squares = float4::sums(a * a, normal * normal, a * a, a * a);
  Axes4 axes;
  if (!(squares[0] > kTiny)) return axes;
  const Float4 scales = float4::all(1) / float4::squareRoot(squares);
  axes.x = a * float4::all(scales[0]);
  axes.y = float4::cross(normal * float4::all(scales[1]), axes.x);
  const float excess = float4::dot(axes.y, axes.y) - 1;
  if (squares[1] > kTiny && excess > -kNoise)
    axes.y *= float4::all(1 - excess * (0.5f - 0.375f * excess));
  else
    axes.y = anyOrthogonal(axes.x);
  axes.z = float4::cross(axes.x, axes.y);
  return axes;
}

}  // namespace adaptive_bvh
