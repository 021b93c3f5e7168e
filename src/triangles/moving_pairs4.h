#pragma once

#include "base/vectors.h"

namespace adaptive_bvh {

/// Four pairs of features over a time interval, in single precision: their corners at its begin and
/// at its end. Corners move in straight lines between.
struct MovingPairs4 {
  Vector4x3 begin[4], end[4];
};

/// The separation to prove, and the errors of the input.
struct MovingPairs4Limits {
  float separation;      ///< the distance that features must exceed
  float position_error;  ///< error of a component of a position
  float share;           ///< share of the interval to consider, from its begin
};

namespace moving_pairs4 {

using vectors::scaled;
using vectors::sum;

ADAPTIVE_BVH_INLINE Float4 chosen(const Float4& where, const Float4& a, const Float4& b) {
  return where > float4::all(0) ? a : b;
}
ADAPTIVE_BVH_INLINE Vector4x3 chosen(const Float4& where, const Vector4x3& a, const Vector4x3& b) {
  return {chosen(where, a.x, b.x), chosen(where, a.y, b.y), chosen(where, a.z, b.z)};
}
/// a / b clamped to [0, 1]; b >= 0.
ADAPTIVE_BVH_INLINE Float4 share(const Float4& a, const Float4& b) {
  const Float4 quotient = a / (b + float4::all(1e-30f));
  return float4::lower(float4::upper(quotient, float4::all(0)), float4::all(1));
}

/// The vector between points of two edges that are nearest, or nearly so.
ADAPTIVE_BVH_INLINE Vector4x3 edgeEdgeDirection(const Vector4x3 (&at)[4]) {
  using vectors::cross;
  using vectors::difference;
  using vectors::dot;
  const Vector4x3 u = difference(at[1], at[0]), v = difference(at[3], at[2]),
                  w = difference(at[2], at[0]);
  const Vector4x3 normal = cross(u, v);
  Float4 s = share(dot(cross(w, v), normal), dot(normal, normal));
  const Float4 t = share(dot(difference(scaled(u, s), w), v), dot(v, v));
  s = share(dot(sum(w, scaled(v, t)), u), dot(u, u));
  return sum(w, difference(scaled(v, t), scaled(u, s)));
}

/// The direction, of any length, from a vertex to the nearest point of a face.
ADAPTIVE_BVH_INLINE Vector4x3 vertexFaceDirection(const Vector4x3 (&at)[4]) {
  using vectors::cross;
  using vectors::difference;
  using vectors::dot;
  const Vector4x3 face[3] = {difference(at[1], at[0]), difference(at[2], at[0]),
                             difference(at[3], at[0])};
  const Vector4x3 edges[3] = {difference(at[2], at[1]), difference(at[3], at[2]),
                              difference(at[1], at[3])};
  const Vector4x3 normal = cross(edges[0], edges[1]);
  Vector4x3 nearest = face[0];
  Float4 least = dot(nearest, nearest);
  Float4 inside = float4::all(1);
  for (int k = 0; k < 3; ++k) {
    const Float4 t = share(-dot(face[k], edges[k]), dot(edges[k], edges[k]));
    const Vector4x3 point = sum(face[k], scaled(edges[k], t));
    const Float4 square = dot(point, point);
    nearest = chosen(least - square, point, nearest);
    least = float4::lower(least, square);
    inside = float4::lower(inside, dot(normal, cross(face[k], edges[k])));
  }
  const Float4 side = dot(normal, face[0]);
  return chosen(inside, chosen(side, normal, scaled(normal, float4::all(-1))), nearest);
}

}  // namespace moving_pairs4

/// A bit for each of four pairs that certainly stays farther apart than the separation, projected
/// on the direction in which it is apart at the begin. docs/bounds.md, 15.
template <int kFirsts>
ADAPTIVE_BVH_INLINE unsigned stayApart(const MovingPairs4& pairs,
                                       const MovingPairs4Limits& limits) {
  using float4::absolute;
  using float4::all;
  using float4::upper;
  using vectors::difference;
  using vectors::dot;
  constexpr float kUnit = 1.f / (1 << 24);
  const Vector4x3 along = kFirsts == 1 ? moving_pairs4::vertexFaceDirection(pairs.begin)
                                       : moving_pairs4::edgeEdgeDirection(pairs.begin);
  Float4 least = all(1e30f), extent = all(0);
  for (int i = 0; i < kFirsts; ++i)
    for (int j = kFirsts; j < 4; ++j) {
      const Vector4x3 first = difference(pairs.begin[j], pairs.begin[i]);
      const Vector4x3 last = difference(pairs.end[j], pairs.end[i]);
      const Float4 gap = dot(along, first), later = dot(along, last);
      const Float4 so_far = gap + all(limits.share) * (later - gap);
      least = float4::lower(least, float4::lower(gap, so_far));
      extent = upper(extent, upper(vectors::size(first), vectors::size(last)));
    }
  const Float4 size = absolute(along.x) + absolute(along.y) + absolute(along.z);
  const Float4 length = float4::squareRoot(dot(along, along)) * all(1 + 8 * kUnit);
  const Float4 margin = size * (all(8 * limits.position_error) + extent * all(32 * kUnit)) +
                        length * all(limits.separation) + all(1e-30f);
  return float4::bits(least > margin);
}

}  // namespace adaptive_bvh
