#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/common/types.h>

#include "geometry/float4.h"

namespace adaptive_bvh {

/// The single-precision coordinates of an update: y = scale (x - origin), along the axes of the
/// mesh. The origin is near the body's middle. The scale is a power of two that brings the body's
/// size to about 1, so that neither huge nor tiny meshes leave the range of single precision. Their
/// unit is a *body unit*.
template <typename S>
class ScaledFrame {
 public:
  using Point = fcl::Vector3<S>;

  ScaledFrame() : ScaledFrame(Point::Zero(), S(1)) {}
  /// `size`: some length of the body, >= 0.
  ScaledFrame(const Point& origin, S size) : origin_(origin) {
    const int limit = std::numeric_limits<S>::max_exponent - 25;
    const int exponent = size > 0 ? std::min(std::max(std::ilogb(size), -limit), limit) : 0;
    scale_ = std::ldexp(S(1), -exponent);
    unit_ = std::ldexp(S(1), exponent);
  }

  /// Where x is. A component is off by 2u of itself, u = 2^-24: the difference is rounded in S, and
  /// converted. One below 2^-126 may become 0.
  ADAPTIVE_BVH_INLINE Float4 operator()(const Point& x) const {
    return Float4{scaled(x[0] - origin_[0]), scaled(x[1] - origin_[1]), scaled(x[2] - origin_[2]),
                  0};
  }
  /// Where that point is in the mesh's coordinates.
  Point back(const Float4& y) const {
    return {origin_[0] + S(y[0]) * unit_, origin_[1] + S(y[1]) * unit_,
            origin_[2] + S(y[2]) * unit_};
  }

  /// A difference of two points, in body units. Off by 2u relative, or by less than 2^-59 in each
  /// component: what is smaller than `kLeast` must not vanish, because a motion of zero is none. (A
  /// huge body may have tiny triangles.)
  ADAPTIVE_BVH_INLINE Float4 displacement(const Point& d) const {
    Float4 v{scaled(d[0]), scaled(d[1]), scaled(d[2]), 0};
    const bool is_large =
        std::abs(v[0]) >= kLeast || std::abs(v[1]) >= kLeast || std::abs(v[2]) >= kLeast;
    if (!is_large && (d[0] != 0 || d[1] != 0 || d[2] != 0)) v[0] = kLeast;
    return v;
  }
  static constexpr float kLeast = 1.f / (1ull << 60);

  const Point& origin() const { return origin_; }
  void moveOrigin(const Point& origin) { origin_ = origin; }
  /// Body units per unit of the mesh, a power of two: products with it are exact.
  S scale() const { return scale_; }
  /// The mesh's units per body unit: the inverse of `scale`, as exact.
  S unit() const { return unit_; }

 private:
  float scaled(S difference) const { return static_cast<float>(difference * scale_); }

  Point origin_;
  S scale_, unit_;
};

}  // namespace adaptive_bvh
