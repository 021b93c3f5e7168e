#pragma once

#include <array>

#include <fcl/common/types.h>

#include "geometry/triangle_pairs4.h"

namespace adaptive_bvh {

/// Four triangles in single precision, from an origin beside them.
struct Triangles4 {
  Vector4x3 corner[3];

  /// Sets one. `scale`: a power of two. Components are off by u of themselves, u = 2^-24.
  template <typename Point>
  void set(int lane, const std::array<Point, 3>& points, const fcl::Vector3d& origin,
           double scale) {
    for (std::size_t c = 0; c < 3; ++c) {
      const fcl::Vector3d x = (points[c].template cast<double>() - origin) * scale;
      corner[c].x[lane] = static_cast<float>(x[0]);
      corner[c].y[lane] = static_cast<float>(x[1]);
      corner[c].z[lane] = static_cast<float>(x[2]);
    }
  }
};

/// Lower bounds of the distances of four triangles p and four triangles q: the largest separation
/// along both normals, the line between the middles, and a direction of the caller's. The origin is
/// near, so that single precision is nearly as good as double: docs/bounds.md, 5.
class TriangleBlock {
 public:
  /// `direction`: of length 1 up to rounding, or zero; from p to q.
  TriangleBlock(const Triangles4& p, const Triangles4& q, const Vector4x3& direction)
      : p_(p), q_(q) {
    setSide(p_, direction, p_side_);
    setSide(q_, direction, q_side_);
    const float size = std::max(packs::largest(p_side_.size), packs::largest(q_side_.size));
    margin_ = float4::all(32 * kUnit * size);
  }

  /// Of the triangles p and triangle `kLane` of q; may be negative. In the scaled unit.
  template <int kLane>
  ADAPTIVE_BVH_INLINE Float4 bounds() const {
    using float4::lower;
    using float4::upper;
    const Vector4x3 q[3] = {lane<kLane>(q_.corner[0]), lane<kLane>(q_.corner[1]),
                            lane<kLane>(q_.corner[2])};
    Float4 best = float4::broadcast<kLane>(q_side_.low) - p_side_.high;
    best = upper<Float4>(best, gap(p_.corner, q, p_side_.normal));
    best = upper<Float4>(best, gap(p_.corner, q, lane<kLane>(q_side_.normal)));
    best = upper<Float4>(
        best,
        gap(p_.corner, q, unit(vectors4::difference(lane<kLane>(q_side_.middle), p_side_.middle))));
    return (best - margin_) * float4::all(1 - 16 * kUnit);
  }
  /// By so much, at most, a bound is smaller than it had to be in exact arithmetic.
  float slack() const { return 4 * margin_[0]; }

 private:
  static constexpr float kUnit = 1.f / (1 << 24);

  struct Side {
    Vector4x3 normal, middle;  // the normal of length 1, or zero; three times the middle
    Float4 low, high;          // along the direction
    Float4 size;               // the largest component
  };

  ADAPTIVE_BVH_INLINE static void setSide(const Triangles4& t, const Vector4x3& direction,
                                          Side& side) {
    using float4::lower;
    using float4::upper;
    const Vector4x3(&c)[3] = t.corner;
    side.normal =
        unit(vectors4::cross(vectors4::difference(c[1], c[0]), vectors4::difference(c[2], c[0])));
    side.middle = {c[0].x + c[1].x + c[2].x, c[0].y + c[1].y + c[2].y, c[0].z + c[1].z + c[2].z};
    const Float4 a = vectors4::dot(direction, c[0]), b = vectors4::dot(direction, c[1]),
                 d = vectors4::dot(direction, c[2]);
    side.low = lower<Float4>(lower<Float4>(a, b), d);
    side.high = upper<Float4>(upper<Float4>(a, b), d);
    side.size = upper<Float4>(upper<Float4>(vectors4::size(c[0]), vectors4::size(c[1])),
                              vectors4::size(c[2]));
  }
  /// Of length 1; zero where squares would underflow.
  ADAPTIVE_BVH_INLINE static Vector4x3 unit(const Vector4x3& v) {
    const Float4 squared = vectors4::dot(v, v), zero = float4::all(0);
    const Float4 inverse =
        squared > float4::all(1e-30f) ? float4::all(1) / float4::squareRoot(squared) : zero;
    return {v.x * inverse, v.y * inverse, v.z * inverse};
  }
  template <int kLane>
  ADAPTIVE_BVH_INLINE static Vector4x3 lane(const Vector4x3& v) {
    using float4::broadcast;
    return {broadcast<kLane>(v.x), broadcast<kLane>(v.y), broadcast<kLane>(v.z)};
  }
  /// The larger one of both sides.
  ADAPTIVE_BVH_INLINE static Float4 gap(const Vector4x3 (&p)[3], const Vector4x3 (&q)[3],
                                        const Vector4x3& along) {
    using float4::lower;
    using float4::upper;
    const Float4 p0 = vectors4::dot(along, p[0]), p1 = vectors4::dot(along, p[1]),
                 p2 = vectors4::dot(along, p[2]);
    const Float4 q0 = vectors4::dot(along, q[0]), q1 = vectors4::dot(along, q[1]),
                 q2 = vectors4::dot(along, q[2]);
    const Float4 forward =
        lower<Float4>(lower<Float4>(q0, q1), q2) - upper<Float4>(upper<Float4>(p0, p1), p2);
    const Float4 backward =
        lower<Float4>(lower<Float4>(p0, p1), p2) - upper<Float4>(upper<Float4>(q0, q1), q2);
    return upper<Float4>(forward, backward);
  }

  const Triangles4 &p_, &q_;
  Side p_side_, q_side_;
  Float4 margin_;
};

}  // namespace adaptive_bvh
