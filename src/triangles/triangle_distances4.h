#pragma once

#include <limits>

#include "base/vectors.h"

namespace adaptive_bvh {

/// Which of four pairs of triangles are certainly nearer than a limit (`near`) or farther
/// (`apart`); a bit for each pair.
struct Nearness4 {
  unsigned near = 0, apart = 0;
};

/// Bounds of the distances of four pairs of triangles.
struct DistanceBounds4 {
  Float4 lower, upper;
};

/// Decides in single precision whether four pairs of triangles p and q are nearer than a limit.
///
/// The distance of two points, one of each triangle, is an upper bound of their distance; the gap
/// along a line is a lower bound. The points are the nearest ones found, and the line is the one
/// between them. Rounding errors of the search for them do not matter, because any points of the
/// triangles and any line give valid bounds. Only the last few operations are subject to rounding,
/// and `margin_` covers it: docs/bounds.md, 16.
class TriangleDistances4 {
 public:
  /// The triangles p: their first corners, and the vectors from these to the other corners.
  struct Seen {
    Seen() = default;
    explicit Seen(const Vector4x3 (&corners)[3]) : first(corners[0]) {
      for (int k = 0; k < 2; ++k) to[k] = vectors::difference(corners[k + 1], first);
      size = float4::upper<Float4>(vectors::size(to[0]), vectors::size(to[1]));
    }
    Vector4x3 first, to[2];
    Float4 size;  ///< the largest absolute component of `to`
  };

  /// `error` bounds the error of a component of a corner.
  ADAPTIVE_BVH_INLINE TriangleDistances4(const Seen& p, const Vector4x3 (&q_corners)[3],
                                         float error) {
    p_[0] = {float4::all(0), float4::all(0), float4::all(0)};
    p_[1] = p.to[0];
    p_[2] = p.to[1];
    Float4 size = p.size;
    for (int k = 0; k < 3; ++k) {
      q_[k] = vectors::difference(q_corners[k], p.first);
      size = float4::upper<Float4>(size, vectors::size(q_[k]));
    }
    margin_ = float4::all(8 * error) + float4::all(64 * kUnit) * size;
  }

  /// Compares the distances of corners, and the gap along the line between the centroids, with the
  /// limit. Decides most pairs, at a tenth of the cost of byFeatures. `pairs` has a bit for each
  /// pair of interest; the others may stay undecided.
  ADAPTIVE_BVH_INLINE Nearness4 byCorners(float limit, unsigned pairs = 15) const {
    Float4 squared = float4::all(std::numeric_limits<float>::max());
    for (const Vector4x3& q : q_) {
      const Vector4x3 from_p[3] = {q, vectors::difference(q, p_[1]), vectors::difference(q, p_[2])};
      for (const Vector4x3& vector : from_p)
        squared = float4::lower<Float4>(squared, vectors::dot(vector, vector));
    }
    const unsigned near = isNear(squared, limit);
    if (!(pairs & ~near)) return {near, 0};
    Nearest centroids;  // three times the vector between them
    centroids.consider(vectors::difference(sum(q_), sum(p_)));
    return {near, apart(centroids, limit)};
  }

  /// Compares the nearest points of edges and faces with the limit.
  Nearness4 byFeatures(float limit) const {
    Nearest nearest;
    considerEdges(nearest);
    const Nearness4 by_edges = {isNear(nearest.squared, limit), apart(nearest, limit)};
    if ((by_edges.near | by_edges.apart) == 15) return by_edges;
    considerFaces(nearest, p_, q_, 1);
    considerFaces(nearest, q_, p_, -1);
    return {isNear(nearest.squared, limit), by_edges.apart | apart(nearest, limit)};
  }

  /// Bounds the distances by the nearest points of edges and faces. Both bounds are the distance,
  /// up to rounding, except for triangles that intersect.
  DistanceBounds4 bounds() const {
    Nearest nearest;
    considerEdges(nearest);
    const DistanceBounds4 by_edges = boundsAlong(nearest);
    if (!packs::any(by_edges.upper - by_edges.lower > float4::all(4) * margin_)) return by_edges;
    considerFaces(nearest, p_, q_, 1);
    considerFaces(nearest, q_, p_, -1);
    const DistanceBounds4 by_all = boundsAlong(nearest);
    return {float4::upper<Float4>(by_edges.lower, by_all.lower), by_all.upper};
  }

 private:
  static constexpr float kUnit = 1.f / (1 << 24);  // unit roundoff
  static constexpr float kSquares = 16 * kUnit;    // relative error of compared squares
  static constexpr float kLeast = 1e-30f;          // the least divisor
  static constexpr float kLeastLine = 1e-20f;      // the least squared length of a line

  /// The shortest vector found so far from p to q.
  struct Nearest {
    Float4 squared = float4::all(std::numeric_limits<float>::max());
    Vector4x3 vector = {float4::all(0), float4::all(0), float4::all(0)};

    ADAPTIVE_BVH_INLINE void consider(const Vector4x3& w) {
      const Float4 square = vectors::dot(w, w);
      keep(square < squared, square, w);
    }
    /// Takes the vector w, whose square is given, in the lanes of `is_nearer`.
    template <typename Mask>
    ADAPTIVE_BVH_INLINE void keep(const Mask& is_nearer, const Float4& square, const Vector4x3& w) {
      squared = is_nearer ? square : squared;
      vector.x = is_nearer ? w.x : vector.x;
      vector.y = is_nearer ? w.y : vector.y;
      vector.z = is_nearer ? w.z : vector.z;
    }
  };

  ADAPTIVE_BVH_INLINE static Vector4x3 sum(const Vector4x3 (&v)[3]) {
    return {v[0].x + v[1].x + v[2].x, v[0].y + v[1].y + v[2].y, v[0].z + v[1].z + v[2].z};
  }
  ADAPTIVE_BVH_INLINE static Float4 clamped(const Float4& v) {
    return float4::lower<Float4>(float4::upper<Float4>(v, float4::all(0)), float4::all(1));
  }

  /// Considers the nearest points of all pairs of edges, parallel ones included: clamps the lines'
  /// nearest point to the first edge (parameter s), takes the point of the second edge nearest to
  /// it (t), then the point of the first edge nearest to that one (s).
  ADAPTIVE_BVH_INLINE void considerEdges(Nearest& nearest) const {
    Vector4x3 p_edge[3], q_edge[3];
    Float4 p_squared[3], q_squared[3], p_inverse[3], q_inverse[3];
    const Float4 least = float4::all(kLeast), one = float4::all(1);
    for (int k = 0; k < 3; ++k) {
      p_edge[k] = vectors::difference(p_[(k + 1) % 3], p_[k]);
      q_edge[k] = vectors::difference(q_[(k + 1) % 3], q_[k]);
      p_squared[k] = vectors::dot(p_edge[k], p_edge[k]);
      q_squared[k] = vectors::dot(q_edge[k], q_edge[k]);
      p_inverse[k] = one / float4::upper<Float4>(p_squared[k], least);
      q_inverse[k] = one / float4::upper<Float4>(q_squared[k], least);
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const Vector4x3 between = vectors::difference(q_[j], p_[i]);
        const Float4 a = p_squared[i], e = q_squared[j], b = vectors::dot(p_edge[i], q_edge[j]),
                     c = vectors::dot(p_edge[i], between), f = vectors::dot(q_edge[j], between);
        const Float4 across = float4::upper<Float4>(a * e - b * b, least);
        Float4 s = clamped((c * e - b * f) / across);
        const Float4 t = clamped((b * s - f) * q_inverse[j]);
        s = clamped((b * t + c) * p_inverse[i]);
        nearest.consider({between.x + q_edge[j].x * t - p_edge[i].x * s,
                          between.y + q_edge[j].y * t - p_edge[i].y * s,
                          between.z + q_edge[j].z * t - p_edge[i].z * s});
      }
  }

  /// Considers the corners of one triangle and their projections on the face of the other, if they
  /// lie inside the face. `sign` is 1 if the face belongs to p, else -1.
  ADAPTIVE_BVH_INLINE static void considerFaces(Nearest& nearest, const Vector4x3 (&face)[3],
                                                const Vector4x3 (&corners)[3], float sign) {
    const Vector4x3 u = vectors::difference(face[1], face[0]),
                    v = vectors::difference(face[2], face[0]), normal = vectors::cross(u, v);
    const Float4 inverse =
        float4::all(1) / float4::upper<Float4>(vectors::dot(normal, normal), float4::all(kLeast));
    const Vector4x3 to_u = vectors::scaled(vectors::cross(v, normal), inverse),
                    to_v = vectors::scaled(vectors::cross(normal, u), inverse);
    const Float4 zero = float4::all(0), one = float4::all(1), signs = float4::all(sign);
    for (const Vector4x3& corner : corners) {  // its projection is face[0] + s u + t v
      const Vector4x3 w = vectors::difference(corner, face[0]);
      const Float4 s = vectors::dot(w, to_u), t = vectors::dot(w, to_v);
      const Vector4x3 vector = vectors::scaled(
          {w.x - u.x * s - v.x * t, w.y - u.y * s - v.y * t, w.z - u.z * s - v.z * t}, signs);
      const Float4 squared = vectors::dot(vector, vector);
      nearest.keep((s >= zero) & (t >= zero) & (s + t <= one) & (squared < nearest.squared),
                   squared, vector);
    }
  }

  /// A bit for each pair whose points, at this squared distance, are certainly within the limit.
  ADAPTIVE_BVH_INLINE unsigned isNear(const Float4& squared, float limit) const {
    const Float4 within = float4::upper<Float4>(float4::all(limit) - margin_, float4::all(0));
    return float4::bits(squared * float4::all(1 + kSquares) < within * within);
  }
  /// The gap along a line, times its length; 0 if there is none.
  ADAPTIVE_BVH_INLINE Float4 gapAlong(const Nearest& line) const {
    using float4::lower;
    using float4::upper;
    const auto along = [&](const Vector4x3& x) { return vectors::dot(line.vector, x); };
    const Float4 high = upper<Float4>(upper<Float4>(along(p_[0]), along(p_[1])), along(p_[2])),
                 low = lower<Float4>(lower<Float4>(along(q_[0]), along(q_[1])), along(q_[2]));
    return upper<Float4>(low - high, float4::all(0));
  }
  /// Bounds of the distances by the nearest points found, and by the gap along their line.
  ADAPTIVE_BVH_INLINE DistanceBounds4 boundsAlong(const Nearest& nearest) const {
    const Float4 length = float4::squareRoot(nearest.squared) * float4::all(1 + kSquares);
    const Float4 gap = gapAlong(nearest) / float4::upper<Float4>(length, float4::all(kLeast));
    return {nearest.squared > float4::all(kLeastLine) ? gap - margin_ : float4::all(0),
            length + margin_};
  }
  /// A bit for each pair whose gap along the line certainly exceeds the limit.
  ADAPTIVE_BVH_INLINE unsigned apart(const Nearest& line, float limit) const {
    const Float4 gap = gapAlong(line), farther = float4::all(limit) + margin_;
    return float4::bits(
        (gap * gap > line.squared * float4::all(1 + kSquares) * (farther * farther)) &
        (line.squared > float4::all(kLeastLine)));
  }

  Vector4x3 p_[3], q_[3];  ///< relative to the first corner of p
  Float4 margin_;          ///< bound of the rounding errors of a length
};

}  // namespace adaptive_bvh
