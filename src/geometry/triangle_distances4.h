#pragma once

#include <limits>

#include "geometry/vectors4.h"

namespace adaptive_bvh {

/// What is certain about the distances of four pairs of triangles and a limit; a bit for each pair.
struct Nearness4 {
  unsigned near = 0, apart = 0;
};

/// Four pairs of triangles p and q in single precision, and whether they are at most so far apart.
///
/// Two points, one of each triangle, are never nearer than the triangles are; a gap along a line is
/// never larger. Both come from the nearest features that are found: whatever is rounded in looking
/// for these, the points are points of the triangles and the line is a line. So only the rounding
/// of the last few operations counts, which `margin` covers: docs/bounds.md, 16.
class TriangleDistances4 {
 public:
  /// `error`: of a component of a corner.
  ADAPTIVE_BVH_INLINE TriangleDistances4(const Vector4x3 (&p_corners)[3],
                                         const Vector4x3 (&q_corners)[3], float error) {
    Float4 size = float4::all(0);
    for (int k = 0; k < 3; ++k) {
      p_[k] = vectors4::difference(p_corners[k], p_corners[0]);
      q_[k] = vectors4::difference(q_corners[k], p_corners[0]);
      size = float4::upper<Float4>(
          size, float4::upper<Float4>(vectors4::size(p_[k]), vectors4::size(q_[k])));
    }
    margin_ = float4::all(8 * error) + float4::all(64 * kUnit) * size;
  }

  /// By the nearest corners, and the line between the middles: that decides most, at a fifth of the
  /// price.
  ADAPTIVE_BVH_INLINE Nearness4 byCorners(float limit) const {
    Nearest nearest, middles;
    for (const Vector4x3& p : p_)
      for (const Vector4x3& q : q_) nearest.consider(vectors4::difference(q, p));
    middles.consider(vectors4::difference(sum(q_), sum(p_)));
    const Nearness4 verdict = this->verdict(nearest, limit);
    return {verdict.near, verdict.apart | apart(middles, limit)};
  }

  /// By the nearest points of edges and faces.
  Nearness4 byFeatures(float limit) const {
    Nearest nearest;
    considerEdges(nearest);
    considerFaces(nearest, p_, q_, 1);
    considerFaces(nearest, q_, p_, -1);
    return verdict(nearest, limit);
  }

 private:
  static constexpr float kUnit = 1.f / (1 << 24);
  static constexpr float kLeast = 1e-30f;  // of a divisor, and of what is no underflow

  /// From p to q.
  struct Nearest {
    Float4 squared = float4::all(std::numeric_limits<float>::max());
    Vector4x3 way = {float4::all(0), float4::all(0), float4::all(0)};

    ADAPTIVE_BVH_INLINE void consider(const Vector4x3& w) {
      const Float4 other = vectors4::dot(w, w);
      keep(other < squared, other, w);
    }
    template <typename Mask>
    ADAPTIVE_BVH_INLINE void keep(const Mask& is_nearer, const Float4& other, const Vector4x3& w) {
      squared = is_nearer ? other : squared;
      way.x = is_nearer ? w.x : way.x;
      way.y = is_nearer ? w.y : way.y;
      way.z = is_nearer ? w.z : way.z;
    }
  };

  ADAPTIVE_BVH_INLINE static Vector4x3 sum(const Vector4x3 (&v)[3]) {
    return {v[0].x + v[1].x + v[2].x, v[0].y + v[1].y + v[2].y, v[0].z + v[1].z + v[2].z};
  }
  ADAPTIVE_BVH_INLINE static Float4 clamped(const Float4& v) {
    return float4::lower<Float4>(float4::upper<Float4>(v, float4::all(0)), float4::all(1));
  }
  ADAPTIVE_BVH_INLINE static Vector4x3 scaled(const Vector4x3& v, const Float4& by) {
    return {v.x * by, v.y * by, v.z * by};
  }

  /// The nearest points of two segments: that on the second for the best of the first, and then
  /// that on the first for it. Of parallel ones, too.
  ADAPTIVE_BVH_INLINE void considerEdges(Nearest& nearest) const {
    Vector4x3 p_edge[3], q_edge[3];
    Float4 p_squared[3], q_squared[3];
    for (int k = 0; k < 3; ++k) {
      p_edge[k] = vectors4::difference(p_[(k + 1) % 3], p_[k]);
      q_edge[k] = vectors4::difference(q_[(k + 1) % 3], q_[k]);
      p_squared[k] = vectors4::dot(p_edge[k], p_edge[k]);
      q_squared[k] = vectors4::dot(q_edge[k], q_edge[k]);
    }
    const Float4 least = float4::all(kLeast);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const Vector4x3 between = vectors4::difference(q_[j], p_[i]);
        const Float4 a = p_squared[i], e = q_squared[j], b = vectors4::dot(p_edge[i], q_edge[j]),
                     c = vectors4::dot(p_edge[i], between), f = vectors4::dot(q_edge[j], between);
        const Float4 across = float4::upper<Float4>(a * e - b * b, least);
        Float4 s = clamped((c * e - b * f) / across);
        const Float4 t = clamped((b * s - f) / float4::upper<Float4>(e, least));
        s = clamped((b * t + c) / float4::upper<Float4>(a, least));
        nearest.consider({between.x + q_edge[j].x * t - p_edge[i].x * s,
                          between.y + q_edge[j].y * t - p_edge[i].y * s,
                          between.z + q_edge[j].z * t - p_edge[i].z * s});
      }
  }

  /// The corners x of one and the points of the other below them. `sign`: 1 where the other is p.
  ADAPTIVE_BVH_INLINE static void considerFaces(Nearest& nearest, const Vector4x3 (&face)[3],
                                                const Vector4x3 (&x)[3], float sign) {
    const Vector4x3 u = vectors4::difference(face[1], face[0]),
                    v = vectors4::difference(face[2], face[0]), normal = vectors4::cross(u, v);
    const Float4 inverse =
        float4::all(1) / float4::upper<Float4>(vectors4::dot(normal, normal), float4::all(kLeast));
    const Vector4x3 to_u = scaled(vectors4::cross(v, normal), inverse),
                    to_v = scaled(vectors4::cross(normal, u), inverse);
    const Float4 zero = float4::all(0), one = float4::all(1), signs = float4::all(sign);
    for (const Vector4x3& corner : x) {
      const Vector4x3 w = vectors4::difference(corner, face[0]);
      const Float4 s = vectors4::dot(w, to_u), t = vectors4::dot(w, to_v);
      const Vector4x3 way = scaled(
          {w.x - u.x * s - v.x * t, w.y - u.y * s - v.y * t, w.z - u.z * s - v.z * t}, signs);
      const Float4 squared = vectors4::dot(way, way);
      nearest.keep((s >= zero) & (t >= zero) & (s + t <= one) & (squared < nearest.squared),
                   squared, way);
    }
  }

  ADAPTIVE_BVH_INLINE Nearness4 verdict(const Nearest& nearest, float limit) const {
    const Float4 length = float4::squareRoot(nearest.squared);
    return {float4::bits(length + margin_ <= float4::all(limit)), apart(nearest, limit)};
  }
  /// Whether the gap along `line.way` is larger.
  ADAPTIVE_BVH_INLINE unsigned apart(const Nearest& line, float limit) const {
    using float4::lower;
    using float4::upper;
    const auto along = [&](const Vector4x3& x) { return vectors4::dot(line.way, x); };
    const Float4 high = upper<Float4>(upper<Float4>(along(p_[0]), along(p_[1])), along(p_[2])),
                 low = lower<Float4>(lower<Float4>(along(q_[0]), along(q_[1])), along(q_[2]));
    const Float4 length = float4::squareRoot(line.squared);
    return float4::bits((low - high > length * (float4::all(limit) + margin_)) &
                        (line.squared > float4::all(kLeast)));
  }

  Vector4x3 p_[3], q_[3];  ///< from the first corner of p
  Float4 margin_;
};

}  // namespace adaptive_bvh
