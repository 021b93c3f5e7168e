#pragma once

#include <cstdint>

#include "geometry/axes.h"

// Also compiled for AVX2: see update/fit_kernels.h.
namespace adaptive_bvh {

/// A rotation in eight bytes, off by less than 0.01 degrees: a unit quaternion in numbers of
/// sixteen bits.
class PackedRotation {
 public:
  PackedRotation() = default;
  /// Columns of a rotation matrix.
  PackedRotation(const float (&x)[3], const float (&y)[3], const float (&z)[3]);

  ADAPTIVE_BVH_INLINE Float4 quaternion() const {
    return Float4{float(numbers_[0]), float(numbers_[1]), float(numbers_[2]), float(numbers_[3])} *
           (1.f / kOne);
  }

 private:
  static constexpr int kOne = 32767;

  std::int16_t numbers_[4] = {0, 0, 0, kOne};
};

/// Rotations from quaternions, which are not quite as long as 1 where their numbers were rounded:
/// one step of Newton's method corrects that.
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

}  // namespace adaptive_bvh
