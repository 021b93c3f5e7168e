#pragma once

#include "triangles/triangle_contact.h"
#include "triangles/triangle_pairs.h"

namespace adaptive_bvh {

/// What products of two to four lengths may lose by underflow, in body units: FCL's, in units of
/// the model, `scale` of which are one body unit, and those of TrianglePairs4. No length is larger
/// than `longest`, in body units.
template <typename S>
float leastProduct(double scale, double longest) {
  const auto lost = [&](double smallest, double unit) {
    const double square = unit * unit;
    return 64 * smallest * square * (square + unit * longest + longest * longest);
  };
  return static_cast<float>(lost(double(std::numeric_limits<S>::min()), scale) +
                            lost(double(std::numeric_limits<float>::min()), 1));
}

/// A difference of numbers of S is off by this share of the extent of a pair, along any axes.
template <typename S>
constexpr float differenceError() {
  return 2 * std::numeric_limits<S>::epsilon();
}

/// Four pairs of triangles from the corners in the model's own numbers, by the differences that
/// FCL's test takes, too.
template <typename S>
class TriangleDifferences {
 public:
  /// Lengths in the pairs are `scale`, a power of two, times those of the corners.
  explicit TriangleDifferences(double scale) : scale_(static_cast<S>(scale)) {}

  ADAPTIVE_BVH_INLINE void set(int lane, const TrianglePoints<S>& p, TrianglePoints<S> q) {
    for (std::size_t c = 0; c < 3; ++c) q[c] -= p[0];
    const fcl::Vector3<S> p1 = p[1] - p[0], p2 = p[2] - p[0];
    set(kPEdges + 0, lane, p1);
    set(kPEdges + 1, lane, p2 - p1);
    set(kPEdges + 2, lane, -p2);
    for (std::size_t c = 0; c < 3; ++c) {
      set(kQEdges + c, lane, q[(c + 1) % 3] - q[c]);
      set(kQCorners + c, lane, q[c]);
    }
  }

  ADAPTIVE_BVH_INLINE TrianglePairs4 pairs() const {
    TrianglePairs4 pairs;
    for (std::size_t c = 0; c < 3; ++c) {
      pairs.p_edges[c] = get(kPEdges + c);
      pairs.q_edges[c] = get(kQEdges + c);
      pairs.q[c] = get(kQCorners + c);
    }
    return pairs;
  }

 private:
  static constexpr std::size_t kPEdges = 0, kQEdges = 3, kQCorners = 6;

  ADAPTIVE_BVH_INLINE void set(std::size_t which, int lane, const fcl::Vector3<S>& v) {
    vectors_[which][lane] =
        Float4{static_cast<float>(v[0] * scale_), static_cast<float>(v[1] * scale_),
               static_cast<float>(v[2] * scale_), 0};
  }
  ADAPTIVE_BVH_INLINE Vector4x3 get(std::size_t which) const {
    const Float4(&v)[4] = vectors_[which];
    return float4::columns(v[0], v[1], v[2], v[3]);
  }

  const S scale_;
  Float4 vectors_[9][4];
};

}  // namespace adaptive_bvh
