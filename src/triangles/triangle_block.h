#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include <fcl/common/types.h>

#include "base/vectors.h"
#include "triangles/triangle_pairs.h"

// Lower bounds of distances of four and four triangles, those of two leaves, in single precision.
namespace adaptive_bvh {

/// Four triangles in single precision, relative to a nearby origin.
struct Triangles4 {
  Vector4x3 corner[3];

  /// Sets the triangle of one lane to (points - origin) * scale, where `scale` is a power of two.
  /// The relative error of a component is u = 2^-24.
  template <typename Point>
  void set(int lane, const std::array<Point, 3>& points, const fcl::Vector3d& origin,
           double scale) {
    for (std::size_t c = 0; c < 3; ++c) {
      const fcl::Vector3d x = (points[c] - origin) * scale;
      corner[c].x[lane] = static_cast<float>(x[0]);
      corner[c].y[lane] = static_cast<float>(x[1]);
      corner[c].z[lane] = static_cast<float>(x[2]);
    }
  }
};

/// Precomputed data of four triangles for TriangleBlock.
struct TriangleSides {
  const Triangles4* triangles = nullptr;
  Vector4x3 normal, middle;  ///< unit normal, or zero; three times the centroid
  Float4 low, high;          ///< range of the corners along `direction`
  float size = 0;            ///< largest absolute component of a corner

  TriangleSides() = default;
  /// `direction` has length 1 up to rounding, or is zero. Keeps a pointer to `t`.
  ADAPTIVE_BVH_INLINE TriangleSides(const Triangles4& t, const Vector4x3& direction)
      : triangles(&t) {
    using float4::lower;
    using float4::upper;
    const Vector4x3(&c)[3] = t.corner;
    normal = unit(vectors::cross(vectors::difference(c[1], c[0]), vectors::difference(c[2], c[0])));
    middle = vectors::sum(vectors::sum(c[0], c[1]), c[2]);
    const Float4 a = vectors::dot(direction, c[0]), b = vectors::dot(direction, c[1]),
                 d = vectors::dot(direction, c[2]);
    low = lower<Float4>(lower<Float4>(a, b), d);
    high = upper<Float4>(upper<Float4>(a, b), d);
    size = packs::largest(upper<Float4>(upper<Float4>(vectors::size(c[0]), vectors::size(c[1])),
                                        vectors::size(c[2])));
  }

  /// Normalizes a direction; zero if its square would underflow.
  ADAPTIVE_BVH_INLINE static Vector4x3 unit(const Vector4x3& v) {
    const Float4 squared = vectors::dot(v, v), zero = float4::all(0);
    const Float4 inverse =
        squared > float4::all(1e-30f) ? float4::all(1) / float4::squareRoot(squared) : zero;
    return {v.x * inverse, v.y * inverse, v.z * inverse};
  }
};

/// Lower bounds of the distances of four triangles p from four triangles q: the largest separation
/// along both normals, the line between the centroids, and a common direction from p to q. The
/// origin must be near the triangles, so that single precision is nearly as good as double:
/// docs/bounds.md, 5.
class TriangleBlock {
 public:
  /// Both arguments must have been made with the same direction.
  TriangleBlock(const TriangleSides& p, const TriangleSides& q)
      : p_(p), q_(q), margin_(float4::all(32 * kUnit * std::max(p.size, q.size))) {}

  /// Lower bounds of the distances of the triangles p from triangle `kLane` of q, in the scaled
  /// unit; may be negative. Stops trying further directions once the bounds of all `lanes`, a bit
  /// for each p, reach `enough`.
  template <int kLane>
  ADAPTIVE_BVH_INLINE Float4 bounds(float enough = std::numeric_limits<float>::infinity(),
                                    unsigned lanes = 15) const {
    using float4::upper;
    const Vector4x3(&corners)[3] = q_.triangles->corner;
    const Vector4x3 q[3] = {lane<kLane>(corners[0]), lane<kLane>(corners[1]),
                            lane<kLane>(corners[2])};
    const Vector4x3(&p)[3] = p_.triangles->corner;
    Float4 best = certain(float4::broadcast<kLane>(q_.low) - p_.high);
    const auto isEnough = [&] {
      return (float4::bits(best >= float4::all(enough)) & lanes) == lanes;
    };
    if (isEnough()) return best;
    best = upper<Float4>(best, certain(gap(p, q, p_.normal)));
    if (isEnough()) return best;
    best = upper<Float4>(best, certain(gap(p, q, lane<kLane>(q_.normal))));
    if (isEnough()) return best;
    const Vector4x3 between = vectors::difference(lane<kLane>(q_.middle), p_.middle);
    return upper<Float4>(best, certain(gap(p, q, TriangleSides::unit(between))));
  }
  /// The most by which rounding margins lower a bound, compared with exact arithmetic.
  float slack() const { return 4 * margin_[0]; }

 private:
  static constexpr float kUnit = 1.f / (1 << 24);  ///< unit roundoff

  /// The separation minus the largest rounding error.
  ADAPTIVE_BVH_INLINE Float4 certain(const Float4& separation) const {
    return (separation - margin_) * float4::all(1 - 16 * kUnit);
  }
  template <int kLane>
  ADAPTIVE_BVH_INLINE static Vector4x3 lane(const Vector4x3& v) {
    using float4::broadcast;
    return {broadcast<kLane>(v.x), broadcast<kLane>(v.y), broadcast<kLane>(v.z)};
  }
  /// The gap of two triangles along a direction, whichever of them comes first.
  ADAPTIVE_BVH_INLINE static Float4 gap(const Vector4x3 (&p)[3], const Vector4x3 (&q)[3],
                                        const Vector4x3& along) {
    using float4::lower;
    using float4::upper;
    const Float4 p0 = vectors::dot(along, p[0]), p1 = vectors::dot(along, p[1]),
                 p2 = vectors::dot(along, p[2]);
    const Float4 q0 = vectors::dot(along, q[0]), q1 = vectors::dot(along, q[1]),
                 q2 = vectors::dot(along, q[2]);
    const Float4 forward =
        lower<Float4>(lower<Float4>(q0, q1), q2) - upper<Float4>(upper<Float4>(p0, p1), p2);
    const Float4 backward =
        lower<Float4>(lower<Float4>(p0, p1), p2) - upper<Float4>(upper<Float4>(q0, q1), q2);
    return upper<Float4>(forward, backward);
  }

  const TriangleSides &p_, &q_;
  const Float4 margin_;
};

/// A slab between two planes that contains everything within a distance of up to four triangles.
/// The planes are perpendicular to the sum of the triangles' normals: on a smooth surface the slab
/// is thin. In single precision. docs/bounds.md, 16.
class LeafSlab {
 public:
  LeafSlab() = default;
  /// The slab around the triangles with these corners, one in each lane; lanes without a triangle
  /// repeat another one. `error` bounds the error of a component of a corner; all components are
  /// below 2.
  ADAPTIVE_BVH_INLINE LeafSlab(const Vector4x3 (&corners)[3], float distance, float error) {
    const Vector4x3 normals = vectors::cross(vectors::difference(corners[1], corners[0]),
                                             vectors::difference(corners[2], corners[0]));
    const Vector4x3 first = {float4::broadcast<0>(normals.x), float4::broadcast<0>(normals.y),
                             float4::broadcast<0>(normals.z)};
    const auto faces_back = vectors::dot(normals, first) < float4::all(0);
    // The normals that look away from the first one are negated, so that they do not cancel.
    const auto sum = [&](const Float4& v) -> Float4 {
      return float4::all(packs::sum(faces_back ? -v : v));
    };
    normal_ = {sum(normals.x), sum(normals.y), sum(normals.z)};
    const Float4 size =
        float4::absolute(normal_.x) + float4::absolute(normal_.y) + float4::absolute(normal_.z);
    const Float4 length = float4::squareRoot(vectors::dot(normal_, normal_));
    const Float4 margin =
        (length * float4::all(kUp) + float4::all(kLeast)) * float4::all(distance * kUp) +
        size * float4::all(4 * error + 48 * kUnit) + float4::all(1e-30f);
    const Range range = along(corners);
    below_ = float4::all(packs::smallest(range.low)) - margin;
    above_ = float4::all(packs::largest(range.high)) + margin;
  }

  /// A bit for each of four other triangles that is certainly farther than the distance from all
  /// triangles of the slab.
  ADAPTIVE_BVH_INLINE unsigned apart(const Vector4x3 (&corners)[3]) const {
    const Range range = along(corners);
    return float4::bits((range.low > above_) | (range.high < below_));
  }

 private:
  static constexpr float kUnit = 1.f / (1 << 24), kUp = 1 + 1.f / (1 << 20);
  static constexpr float kLeast = 1e-18f;  // larger than any length whose square underflows

  struct Range {
    Float4 low, high;
  };
  /// The range of each triangle's corners along the slab's normal.
  ADAPTIVE_BVH_INLINE Range along(const Vector4x3 (&corners)[3]) const {
    using float4::lower;
    using float4::upper;
    using vectors::dot;
    const Float4 a = dot(normal_, corners[0]), b = dot(normal_, corners[1]),
                 c = dot(normal_, corners[2]);
    return {lower<Float4>(lower<Float4>(a, b), c), upper<Float4>(upper<Float4>(a, b), c)};
  }

  Vector4x3 normal_;      ///< of any length, repeated in all lanes
  Float4 below_, above_;  ///< the planes' heights along the normal, repeated in all lanes
};

}  // namespace adaptive_bvh
