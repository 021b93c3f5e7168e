#pragma once

#include "base/vectors.h"

namespace adaptive_bvh {

/// Four pairs of features, one in each lane, over a time interval, in single precision: the corners
/// at its begin and at its end, between which they move in straight lines. The corners are a vertex
/// and the three corners of a face, or the two ends of each of two edges.
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

/// For each lane, `a` if `number` is positive, else `b`.
ADAPTIVE_BVH_INLINE Float4 ifPositive(const Float4& number, const Float4& a, const Float4& b) {
  return number > float4::all(0) ? a : b;
}
ADAPTIVE_BVH_INLINE Vector4x3 ifPositive(const Float4& number, const Vector4x3& a,
                                         const Vector4x3& b) {
  return {ifPositive(number, a.x, b.x), ifPositive(number, a.y, b.y), ifPositive(number, a.z, b.z)};
}
/// a / b clamped to [0, 1]; b >= 0.
ADAPTIVE_BVH_INLINE Float4 share(const Float4& a, const Float4& b) {
  const Float4 quotient = a / (b + float4::all(1e-30f));
  return float4::lower(float4::upper(quotient, float4::all(0)), float4::all(1));
}

/// The vector between points of two edges that are nearest, or nearly so, given the edges' corners.
ADAPTIVE_BVH_INLINE Vector4x3 edgeEdgeDirection(const Vector4x3 (&corners)[4]) {
  using vectors::cross;
  using vectors::difference;
  using vectors::dot;
  const Vector4x3 u = difference(corners[1], corners[0]), v = difference(corners[3], corners[2]),
                  w = difference(corners[2], corners[0]);
  const Vector4x3 normal = cross(u, v);
  Float4 s = share(dot(cross(w, v), normal), dot(normal, normal));
  const Float4 t = share(dot(difference(scaled(u, s), w), v), dot(v, v));
  s = share(dot(sum(w, scaled(v, t)), u), dot(u, u));
  return sum(w, difference(scaled(v, t), scaled(u, s)));
}

/// The direction, of any length, from a vertex (the first corner) to the nearest point of a face:
/// the normal if the vertex projects into the face, else the vector to the nearest point of a side.
ADAPTIVE_BVH_INLINE Vector4x3 vertexFaceDirection(const Vector4x3 (&corners)[4]) {
  using vectors::cross;
  using vectors::difference;
  using vectors::dot;
  const Vector4x3 face[3] = {difference(corners[1], corners[0]), difference(corners[2], corners[0]),
                             difference(corners[3], corners[0])};
  const Vector4x3 edges[3] = {difference(corners[2], corners[1]),
                              difference(corners[3], corners[2]),
                              difference(corners[1], corners[3])};
  const Vector4x3 normal = cross(edges[0], edges[1]);
  Vector4x3 nearest = face[0];
  Float4 least = dot(nearest, nearest);
  Float4 inside = float4::all(1);
  for (int k = 0; k < 3; ++k) {
    const Float4 t = share(-dot(face[k], edges[k]), dot(edges[k], edges[k]));
    const Vector4x3 point = sum(face[k], scaled(edges[k], t));
    const Float4 square = dot(point, point);
    nearest = ifPositive(least - square, point, nearest);
    least = float4::lower(least, square);
    inside = float4::lower(inside, dot(normal, cross(face[k], edges[k])));
  }
  const Float4 side = dot(normal, face[0]);
  return ifPositive(inside, ifPositive(side, normal, scaled(normal, float4::all(-1))), nearest);
}

/// The vector, of any length, between the nearest points of the features at the begin.
template <int kFirsts>
ADAPTIVE_BVH_INLINE Vector4x3 directionAtBegin(const MovingPairs4& pairs) {
  return kFirsts == 1 ? vertexFaceDirection(pairs.begin) : edgeEdgeDirection(pairs.begin);
}

/// The part of a vector perpendicular to the mean motion of the second feature relative to the
/// first.
template <int kFirsts>
ADAPTIVE_BVH_INLINE Vector4x3 acrossMotion(const MovingPairs4& pairs, const Vector4x3& vector) {
  const Float4 none = float4::all(0);
  Vector4x3 motion = {none, none, none};
  for (int i = 0; i < 4; ++i)
    motion = vectors::sum(motion,
                          scaled(vectors::difference(pairs.end[i], pairs.begin[i]),
                                 float4::all(i < kFirsts ? -1.f / kFirsts : 1.f / (4 - kFirsts))));
  const Float4 along =
      vectors::dot(vector, motion) / (vectors::dot(motion, motion) + float4::all(1e-30f));
  return vectors::difference(vector, scaled(motion, along));
}

/// What a gap along a direction must exceed: the errors, and the separation. `extent` bounds
/// differences of positions.
ADAPTIVE_BVH_INLINE Float4 leastGap(const Vector4x3& along, const Float4& extent,
                                    const MovingPairs4Limits& limits) {
  using float4::absolute;
  using float4::all;
  constexpr float kUnit = 1.f / (1 << 24);  // unit roundoff
  const Float4 size = absolute(along.x) + absolute(along.y) + absolute(along.z);
  const Float4 length = float4::squareRoot(vectors::dot(along, along)) * all(1 + 8 * kUnit);
  return size * (all(8 * limits.position_error) + extent * all(32 * kUnit)) +
         length * all(limits.separation) + all(1e-30f);
}

/// How far features are apart along a direction, and the bound of differences of positions.
struct Gaps {
  Float4 gap, extent;
};
/// Gaps of all positions in some sets of corners; differences are from the first corner of the
/// first.
template <int kFirsts, std::size_t kSets>
ADAPTIVE_BVH_INLINE Gaps gapsOf(const Vector4x3 (*const (&sets)[kSets])[4],
                                const Vector4x3& along) {
  const Vector4x3& origin = (*sets[0])[0];
  Float4 first = float4::all(-1e30f), second = float4::all(1e30f), extent = float4::all(0);
  for (int i = 0; i < 4; ++i)
    for (const auto* corners : sets) {
      const Vector4x3 x = vectors::difference((*corners)[i], origin);
      const Float4 height = vectors::dot(along, x);
      extent = float4::upper(extent, vectors::size(x));
      if (i < kFirsts)
        first = float4::upper(first, height);
      else
        second = float4::lower(second, height);
    }
  return {second - first, extent};
}

/// Whether a plane perpendicular to a direction separates the ways of the features.
template <int kFirsts>
ADAPTIVE_BVH_INLINE unsigned hasPlaneAcross(const MovingPairs4& pairs, const Vector4x3& along,
                                            const MovingPairs4Limits& limits) {
  const Gaps ways = gapsOf<kFirsts>({&pairs.begin, &pairs.end}, along);
  return float4::bits(ways.gap > leastGap(along, ways.extent, limits));
}

}  // namespace moving_pairs4

/// A bit for each of four pairs that certainly stays farther apart than the separation. Tested by
/// the gap along one direction, that between the nearest points at the begin; the gap of two
/// corners along it is linear in time. `kFirsts` is the number of corners of the first feature: 1
/// for a vertex and a face, 2 for two edges. docs/bounds.md, 15.
template <int kFirsts>
ADAPTIVE_BVH_INLINE unsigned stayApart(const MovingPairs4& pairs,
                                       const MovingPairs4Limits& limits) {
  using float4::all;
  using float4::upper;
  using vectors::difference;
  using vectors::dot;
  const Vector4x3 along = moving_pairs4::directionAtBegin<kFirsts>(pairs);
  Float4 least = all(1e30f), extent = all(0);
  for (int i = 0; i < kFirsts; ++i)
    for (int j = kFirsts; j < 4; ++j) {
      const Vector4x3 at_begin = difference(pairs.begin[j], pairs.begin[i]);
      const Vector4x3 at_end = difference(pairs.end[j], pairs.end[i]);
      const Float4 first_gap = dot(along, at_begin), last_gap = dot(along, at_end);
      const Float4 gap_at_share = first_gap + all(limits.share) * (last_gap - first_gap);
      least = float4::lower(least, float4::lower(first_gap, gap_at_share));
      extent = upper(extent, upper(vectors::size(at_begin), vectors::size(at_end)));
    }
  return float4::bits(least > moving_pairs4::leastGap(along, extent, limits));
}

/// A bit for each of four pairs whose ways a plane that does not move certainly separates, by more
/// than the separation: so no order of the motions of the corners brings the features together. Two
/// directions are tried: that between the nearest points at the begin, and its part perpendicular
/// to the relative motion. docs/bounds.md, 15.
template <int kFirsts>
ADAPTIVE_BVH_INLINE unsigned haveFixedPlane(const MovingPairs4& pairs,
                                            const MovingPairs4Limits& limits) {
  using namespace moving_pairs4;
  const Vector4x3 along = directionAtBegin<kFirsts>(pairs);
  const unsigned bits = hasPlaneAcross<kFirsts>(pairs, along, limits);
  return bits == 15
             ? bits
             : bits | hasPlaneAcross<kFirsts>(pairs, acrossMotion<kFirsts>(pairs, along), limits);
}

/// Lower bounds of the distances of the features at the begin; less than 0 if nothing is known.
template <int kFirsts>
ADAPTIVE_BVH_INLINE Float4 leastDistances(const MovingPairs4& pairs, float position_error) {
  using float4::all;
  const Vector4x3 along = moving_pairs4::directionAtBegin<kFirsts>(pairs);
  const auto gaps = moving_pairs4::gapsOf<kFirsts>({&pairs.begin}, along);
  const Float4 sure =
      gaps.gap - moving_pairs4::leastGap(along, gaps.extent, {0, position_error, 1});
  const Float4 length = float4::squareRoot(vectors::dot(along, along)) * all(1 + 1.f / (1 << 20));
  return sure / (length + all(1e-30f));
}

}  // namespace adaptive_bvh
