#pragma once

#include <cstdint>

#include <type_traits>
#include <utility>

#include "base/vectors.h"

// Axes of bounding volumes in packs (one frame per lane), and in the form in which a node stores
// them between refits (KeptAxes). Also compiled for AVX2: see thesis/volumes/fit_kernels.h.
namespace adaptive_bvh {

namespace packs {

/// The type of the numbers in a pack of any size.
template <typename P>
using Number = std::remove_reference_t<decltype(std::declval<P&>()[0])>;

/// Whether a comparison holds in any lane, or in all lanes, of a pack of any size.
template <typename Mask>
ADAPTIVE_BVH_INLINE bool inAny(const Mask& mask) {
  if constexpr (sizeof(mask[0]) == 4)
    return bits(mask) != 0;
  else
    return any(mask);
}
template <typename Mask>
ADAPTIVE_BVH_INLINE bool inEach(const Mask& mask) {
  return !inAny(~mask);
}

}  // namespace packs

/// The axes of right-handed orthonormal frames, one frame per lane of the pack.
template <typename P>
struct Axes {
  Vectors<P> x, y, z;

  /// The vectors that have the components a, b and c along the axes.
  ADAPTIVE_BVH_INLINE Vectors<P> combine(const P& a, const P& b, const P& c) const {
    return {x.x * a + y.x * b + z.x * c, x.y * a + y.y * b + z.y * c, x.z * a + y.z * b + z.z * c};
  }
  /// The components of vectors along the axes.
  ADAPTIVE_BVH_INLINE Vectors<P> components(const Vectors<P>& v) const {
    return {vectors::dot(x, v), vectors::dot(y, v), vectors::dot(z, v)};
  }
  /// The components of other axes along these: the rotation from these to the others.
  ADAPTIVE_BVH_INLINE Axes components(const Axes& other) const {
    return {components(other.x), components(other.y), components(other.z)};
  }
  /// The axes whose components along these axes are given.
  ADAPTIVE_BVH_INLINE Axes operator*(const Axes& components) const {
    return {combine(components.x.x, components.x.y, components.x.z),
            combine(components.y.x, components.y.y, components.y.z),
            combine(components.z.x, components.z.y, components.z.z)};
  }
  /// The axes rotated about z by angles with these cosines and sines.
  ADAPTIVE_BVH_INLINE Axes turned(const P& cosine, const P& sine) const {
    return {vectors::sum(vectors::scaled(x, cosine), vectors::scaled(y, sine)),
            vectors::difference(vectors::scaled(y, cosine), vectors::scaled(x, sine)), z};
  }
};

namespace vectors {

/// Selects a or b in each lane.
template <typename Mask, typename P>
ADAPTIVE_BVH_INLINE Vectors<P> select(const Mask& mask, const Vectors<P>& a, const Vectors<P>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

}  // namespace vectors

/// Unit vectors orthogonal to unit vectors: products with x or y, whichever is far from parallel.
template <typename P>
ADAPTIVE_BVH_INLINE Vectors<P> anyOrthogonal(const Vectors<P>& x) {
  const P one = packs::filled<P>(1), zero{};
  const auto use_x = packs::absolute<P>(x.x) < 0.6f;
  const Vectors<P> across =
      vectors::cross(x, Vectors<P>{use_x ? one : zero, use_x ? zero : one, zero});
  return vectors::scaled<P>(across, one / packs::squareRoot(vectors::dot(across, across)));
}

/// Right-handed axes, the first along a, the third orthogonal to a and b; arbitrary where a and b
/// do not determine them. Orthonormal up to 28 units of roundoff: if a and b are nearly parallel,
/// their product is inaccurate, and so is the length of the second axis, which is therefore
/// normalized again. docs/bounds.md, 11.
template <typename P>
ADAPTIVE_BVH_INLINE Axes<P> axesAlong(const Vectors<P>& a, const Vectors<P>& b) {
  // Squares above kTiny are not affected by underflow. If the square of the second axis is below 1
  // by more than kNoise, rounding errors are a large part of the product of a and b.
  using Number = packs::Number<P>;
  constexpr Number kTiny = static_cast<Number>(sizeof(Number) == 4 ? 1e-36 : 1e-300);
  constexpr Number kNoise = Number(0.005f);
  const P one = packs::filled<P>(1), zero{};
  const P squares = vectors::dot(a, a);
  const auto is_vector = squares > kTiny;
  Axes<P> axes;
  axes.x = vectors::select(is_vector, vectors::scaled<P>(a, one / packs::squareRoot(squares)),
                           Vectors<P>{one, zero, zero});
  const Vectors<P> normal = vectors::cross(axes.x, b);
  const P squares_of_normal = vectors::dot(normal, normal);
  axes.y = vectors::cross(vectors::scaled<P>(normal, one / packs::squareRoot(squares_of_normal)),
                          axes.x);
  const P squares_of_y = vectors::dot(axes.y, axes.y);
  const auto is_plane = (squares_of_normal > kTiny) & (squares_of_y > 1 - kNoise);
  axes.y = vectors::scaled<P>(axes.y, one / packs::squareRoot(squares_of_y));
  if (!packs::inEach(is_plane)) axes.y = vectors::select(is_plane, axes.y, anyOrthogonal(axes.x));
  axes.z = vectors::cross(axes.x, axes.y);
  return axes;
}

/// A rotation in eight bytes, with an error below 0.01 degrees: a unit quaternion of four 16-bit
/// numbers.
class PackedRotation {
 public:
  PackedRotation() = default;
  /// From the columns of a rotation matrix.
  PackedRotation(const float (&x)[3], const float (&y)[3], const float (&z)[3]);

  /// The quaternion (x, y, z, w); its length differs slightly from 1.
  ADAPTIVE_BVH_INLINE Float4 quaternion() const {
    return Float4{float(numbers_[0]), float(numbers_[1]), float(numbers_[2]), float(numbers_[3])} *
           (1.f / kOne);
  }

 private:
  static constexpr int kOne = 32767;  ///< stands for the number 1

  std::int16_t numbers_[4] = {0, 0, 0, kOne};  ///< x, y, z, w; initially the identity
};

/// The rotations of quaternions i, j, k, r (r is the real part), as the axes that they make of the
/// coordinate axes. The lengths of the quaternions differ slightly from 1, because their numbers
/// were rounded: one step of Newton's method corrects that.
template <typename P>
ADAPTIVE_BVH_INLINE Axes<P> rotations(const P& i, const P& j, const P& k, const P& r) {
  const P scale = 1.5f - 0.5f * (i * i + j * j + k * k + r * r);
  const P x = i * scale, y = j * scale, z = k * scale, w = r * scale;
  const P x2 = x + x, y2 = y + y, z2 = z + z;
  const P xx = x2 * x, yy = y2 * y, zz = z2 * z, xy = x2 * y, xz = x2 * z, yz = y2 * z, wx = x2 * w,
          wy = y2 * w, wz = z2 * w;
  return {{1 - yy - zz, xy + wz, xz - wy},
          {xy - wz, 1 - xx - zz, yz + wx},
          {xz + wy, yz - wx, 1 - xx - yy}};
}

/// The data about an inner node that refits need.
struct KeptAxes {
  std::uint64_t slots = 0;  ///< vertices below the node, as VertexSlots::Set::bits
  /// The axes last chosen for the node's volume, relative to a frame spanned by three of its
  /// vertices (FitKernels::nodeFrames), so that they rotate with the node.
  PackedRotation rotation;
  float area = 0;  ///< surface area of the volume when its axes were chosen, in body units
  /// For two triangles with a common edge, instead of axes: the ends of the edge and the two other
  /// corners, as offsets in the block of slots. Four equal offsets for other nodes.
  std::uint8_t quad[4] = {0, 0, 0, 0};

  /// Whether the node consists of two triangles with a common edge.
  bool isQuad() const { return quad[0] != quad[1]; }
};

}  // namespace adaptive_bvh
