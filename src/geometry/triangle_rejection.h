#pragma once

#include <limits>

#include "geometry/float4.h"

namespace adaptive_bvh {

/// Four vectors in structure of arrays.
using Vector4x3 = float4::Columns;

namespace vectors4 {

ADAPTIVE_BVH_INLINE Vector4x3 difference(const Vector4x3& a, const Vector4x3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
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

/// Four triangles.
struct Triangles4 {
  Vector4x3 corners[3];
};

/// What may be off in the tests below.
struct RejectionError {
  /// Of a position's component, at least 2^-22. Infinite: then nothing is rejected.
  float position;
  /// As above, for the tests along edge normals, whose products have a factor more.
  float position_at_edges;
};

/// Four pairs of triangles, each of which FCL's test may call apart: it computes the projections of
/// both triangles on seventeen axes, and finds them apart where they are on one of these. Here the
/// same axes are tried in single precision, less all that both computations can be off by: pairs
/// that are apart by more than that are apart for FCL, too. docs/bounds.md, 13.
///
/// Results have a bit for each of the four pairs that surely is apart.
class TriangleRejection {
 public:
  ADAPTIVE_BVH_INLINE TriangleRejection(const Triangles4& p, const Triangles4& q,
                                        const RejectionError& error)
      : error_(error) {
    using vectors4::difference;
    using vectors4::size;
    for (int k = 0; k < 3; ++k) {
      p_edges_[k] = difference(p.corners[(k + 1) % 3], p.corners[k]);
      q_edges_[k] = difference(q.corners[(k + 1) % 3], q.corners[k]);
      q_[k] = difference(q.corners[k], p.corners[0]);
    }
    const Float4 slack = float4::all(4 * error.position);
    p_size_ = largest(size(p_edges_[0]), size(p_edges_[1]), size(p_edges_[2])) + slack;
    q_size_ = largest(size(q_edges_[0]), size(q_edges_[1]), size(q_edges_[2])) + slack;
    extent_ = largest(size(q_[0]), size(q_[1]), size(q_[2])) + slack + p_size_ + q_size_;
    p_normal_ = vectors4::cross(p_edges_[0], p_edges_[1]);
    q_normal_ = vectors4::cross(q_edges_[0], q_edges_[1]);
  }

  /// Along the normals of both.
  ADAPTIVE_BVH_INLINE unsigned byPlanes() const {
    using vectors4::dot;
    const Float4 zero = float4::all(0);
    const Range q_along_p = range(dot(p_normal_, q_[0]), dot(p_normal_, q_[1]),
                                  dot(p_normal_, q_[2]));
    const Float4 base = dot(q_normal_, q_[0]);
    const Float4 second = dot(q_normal_, p_edges_[0]), third = -dot(q_normal_, p_edges_[2]);
    const Range p_along_q = range(zero, second, third);
    return float4::bits((gap({zero, zero}, q_along_p) > margin(p_size_)) |
                        (gap(p_along_q, {base, base}) > margin(q_size_)));
  }

  /// Along the products of an edge of one and an edge of the other.
  ADAPTIVE_BVH_INLINE unsigned byEdges() const {
    const Float4 zero = float4::all(0);
    const Float4 least = margin(float4::upper(p_size_, q_size_));
    auto apart = zero > zero;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const Vector4x3 axis = vectors4::cross(p_edges_[i], q_edges_[j]);
        const Range p = pAlong(axis), q = qAlong(axis);
        apart |= gap(p, q) > least;
      }
    return float4::bits(apart);
  }

  /// In either's plane, at right angles to its edges: triangles side by side.
  ADAPTIVE_BVH_INLINE unsigned byEdgeNormals() const {
    const Float4 zero = float4::all(0);
    auto apart = zero > zero;
    const Float4 least_p = edgeMargin(p_size_), least_q = edgeMargin(q_size_);
    for (int i = 0; i < 3; ++i) {
      const Vector4x3 a = vectors4::cross(p_edges_[i], p_normal_);
      const Vector4x3 b = vectors4::cross(q_edges_[i], q_normal_);
      apart |= gap(pAlong(a), qAlong(a)) > least_p;
      apart |= gap(pAlong(b), qAlong(b)) > least_q;
    }
    return float4::bits(apart);
  }

 private:
  struct Range {
    Float4 low, high;
  };

  ADAPTIVE_BVH_INLINE static Float4 largest(const Float4& a, const Float4& b, const Float4& c) {
    return float4::upper(float4::upper(a, b), c);
  }
  ADAPTIVE_BVH_INLINE static Range range(const Float4& a, const Float4& b, const Float4& c) {
    return {float4::lower(float4::lower(a, b), c), largest(a, b, c)};
  }
  ADAPTIVE_BVH_INLINE static Float4 gap(const Range& a, const Range& b) {
    return float4::upper<Float4>(a.low - b.high, b.low - a.high);
  }

  /// The three corners, from the first triangle's first corner.
  ADAPTIVE_BVH_INLINE Range pAlong(const Vector4x3& axis) const {
    return range(float4::all(0), vectors4::dot(axis, p_edges_[0]),
                 -vectors4::dot(axis, p_edges_[2]));
  }
  ADAPTIVE_BVH_INLINE Range qAlong(const Vector4x3& axis) const {
    return range(vectors4::dot(axis, q_[0]), vectors4::dot(axis, q_[1]),
                 vectors4::dot(axis, q_[2]));
  }

  /// Along a product of two edges that are no larger than `edge`.
  ADAPTIVE_BVH_INLINE Float4 margin(const Float4& edge) const {
    return edge * extent_ *
           (float4::all(128 * error_.position) + edge * float4::all(512 * kUnit));
  }
  /// Along a product of three.
  ADAPTIVE_BVH_INLINE Float4 edgeMargin(const Float4& edge) const {
    return edge * edge * extent_ *
           (float4::all(256 * error_.position_at_edges) + edge * float4::all(1024 * kUnit));
  }

  static constexpr float kUnit = 1.f / (1 << 24);

  const RejectionError error_;
  Vector4x3 p_edges_[3], q_edges_[3];  // k: from corner k to the next
  Vector4x3 q_[3];
  Vector4x3 p_normal_, q_normal_;
  Float4 p_size_, q_size_, extent_;
};

}  // namespace adaptive_bvh
