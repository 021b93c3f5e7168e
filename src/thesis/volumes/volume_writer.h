#pragma once

#include "thesis/volumes/body_volumes.h"

// Also compiled for AVX2: see thesis/volumes/fit_kernels.h.
namespace adaptive_bvh {

/// The transform from a step's coordinates to the model's.
struct ModelCoordinates {
  double origin[3], unit;
  double error;       ///< error of a fit in addition to its own operations: docs/bounds.md, 11
  double askew_axes;  ///< enlargement of a box for inexact axes, as a share of the sum of its half
                      ///< sides
};

/// Converts volumes from the coordinates of a step to FCL's in the model's, enlarged by the
/// rounding errors of a fit in single precision: docs/bounds.md, 11. Processes half of the lanes of
/// BodyVolumes.
template <typename P, int kHalf, bool kWithBox>
class VolumeWriter {
 public:
  using Numbers = typename Lanes<P>::Doubles;
  static constexpr int kCount = Lanes<P>::kCount / 2;

  ADAPTIVE_BVH_INLINE VolumeWriter(const BodyVolumes<P>& of, const ModelCoordinates& to)
      : x_(unitVectors(widened(of.axes.x))) {
    const Vectors<Numbers> askew = widened(of.axes.y);
    const Numbers d = vectors::dot(x_, askew);
    y_ = unitVectors({askew.x - x_.x * d, askew.y - x_.y * d, askew.z - x_.z * d});
    z_ = vectors::cross(x_, y_);
    const Vectors<Numbers> corner = widened(of.corner);
    corner_ = {to.origin[0] + corner.x * to.unit, to.origin[1] + corner.y * to.unit,
               to.origin[2] + corner.z * to.unit};
    for (int k = 0; k < 2; ++k) sides_[k] = widened(of.sides[k]) * to.unit;
    const Numbers around = widened(of.radius) * to.unit;
    // The rounding errors of operations are relative to the sides and the diameter.
    constexpr double kOperations = 1. / (1 << 16);
    const Numbers margin = to.error + kOperations * (sides_[0] + sides_[1] + 2 * around);
    radius_ = around + margin;
    corner_sum_ = coordinateSum(corner_) + radius_ + sides_[0] + sides_[1];
    if constexpr (kWithBox) setBox(of, to, around, margin);
  }

  /// Writes lane i to the contiguous numbers of FCL's RSS, or of its OBB and RSS.
  template <typename S>
  ADAPTIVE_BVH_INLINE void write(int i, S* to) const {
    if constexpr (kWithBox) {
      to = write(i, {&x_, &y_, &z_, &middle_}, to);
      for (int k = 0; k < 3; ++k) *to++ = S(half_[k][i]);
    }
    to = write(i, {&x_, &y_, &z_, &corner_}, to);
    to[0] = S(sides_[0][i]);
    to[1] = S(sides_[1][i]);
    to[2] = S(radius_[i]);
  }

  /// The Volume::cornerSum of each volume.
  ADAPTIVE_BVH_INLINE const Numbers& cornerSum() const { return corner_sum_; }

 private:
  ADAPTIVE_BVH_INLINE static Numbers widened(const P& v) {
    return Lanes<P>::template widened<kHalf>(v);
  }
  ADAPTIVE_BVH_INLINE static Vectors<Numbers> widened(const Vectors<P>& v) {
    return {widened(v.x), widened(v.y), widened(v.z)};
  }
  /// Normalizes vectors whose lengths differ from 1 by at most 1e-5: the series of 1 / sqrt(n)
  /// about 1, whose next term is below 1e-15.
  ADAPTIVE_BVH_INLINE static Vectors<Numbers> unitVectors(const Vectors<Numbers>& v) {
    const Numbers d = vectors::dot(v, v) - 1;
    return vectors::scaled<Numbers>(v, 1 - d * (0.5 - d * 0.375));
  }
  ADAPTIVE_BVH_INLINE static Numbers coordinateSum(const Vectors<Numbers>& v) {
    return packs::absolute<Numbers>(v.x) + packs::absolute<Numbers>(v.y) +
           packs::absolute<Numbers>(v.z);
  }
  ADAPTIVE_BVH_INLINE void setBox(const BodyVolumes<P>& of, const ModelCoordinates& to,
                                  const Numbers& around, const Numbers& margin) {
    const Numbers a = widened(of.to_middle[0]) * to.unit, b = widened(of.to_middle[1]) * to.unit;
    middle_ = {corner_.x + x_.x * a + y_.x * b, corner_.y + x_.y * a + y_.y * b,
               corner_.z + x_.z * a + y_.z * b};
    half_[0] = widened(of.half[0]) * to.unit;
    half_[1] = widened(of.half[1]) * to.unit;
    half_[2] = around;
    const Numbers more = margin + to.askew_axes * (half_[0] + half_[1] + half_[2]);
    for (Numbers& half : half_) half += more;
    const Numbers longest =
        packs::upper<Numbers>(packs::upper<Numbers>(half_[0], half_[1]), half_[2]);
    corner_sum_ = packs::upper<Numbers>(corner_sum_, coordinateSum(middle_) + longest);
  }
  template <typename S>
  ADAPTIVE_BVH_INLINE static S* write(int i, const Vectors<Numbers>* const (&vectors)[4], S* to) {
    for (const Vectors<Numbers>* v : vectors) {
      *to++ = S(v->x[i]);
      *to++ = S(v->y[i]);
      *to++ = S(v->z[i]);
    }
    return to;
  }

  Vectors<Numbers> x_, y_, z_, corner_, middle_;
  Numbers sides_[2], radius_, corner_sum_, half_[3];
};

/// Writes the volumes of the first `count` lanes to `to`. Returns the largest Volume::cornerSum.
template <bool kWithBox, typename P, typename S>
ADAPTIVE_BVH_INLINE double writeVolumes(const BodyVolumes<P>& volumes, const ModelCoordinates& in,
                                        S* const* to, int count) {
  constexpr int kHalf = Lanes<P>::kCount / 2;
  double largest = 0;
  const auto writeHalf = [&](const auto& half, int first) {
    for (int i = 0; i < kHalf; ++i) {
      if (first + i < count) half.write(i, to[first + i]);
      largest = half.cornerSum()[i] > largest ? half.cornerSum()[i] : largest;
    }
  };
  writeHalf(VolumeWriter<P, 0, kWithBox>(volumes, in), 0);
  if (count > kHalf) writeHalf(VolumeWriter<P, 1, kWithBox>(volumes, in), kHalf);
  return largest;
}

}  // namespace adaptive_bvh
