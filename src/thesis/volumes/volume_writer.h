#pragma once

#include "thesis/volumes/body_volumes.h"

// Writes fitted volumes (BodyVolumes) to FCL's. Also compiled for AVX2: see fit_kernels.h.
namespace adaptive_bvh {

/// The transform from a step's coordinates (ScaledFrame) to the model's: x = origin + unit y.
/// `error` and the volumes written are in the model's units.
struct ModelCoordinates {
  double origin[3], unit;
  double error;       ///< error of a fit in addition to its own operations: docs/bounds.md, 11
  double askew_axes;  ///< enlargement of a box for inexact axes, as a share of the sum of its half
                      ///< sides
};

/// Converts volumes from the coordinates of a step to FCL's in the model's, enlarged by the
/// rounding errors of a fit in single precision: docs/bounds.md, 11. Computes in double precision,
/// so it processes half of the lanes of BodyVolumes: the lower (kHalf = 0) or the upper (1).
template <typename P, int kHalf, bool kWithBox>
class VolumeWriter {
 public:
  using Numbers = typename Lanes<P>::Doubles;

  ADAPTIVE_BVH_INLINE VolumeWriter(const BodyVolumes<P>& volumes, const ModelCoordinates& model)
      : x_(unitVectors(widened(volumes.axes.x))) {
    // Makes the axes orthonormal in double precision.
    const Vectors<Numbers> askew = widened(volumes.axes.y);
    const Numbers d = vectors::dot(x_, askew);
    y_ = unitVectors({askew.x - x_.x * d, askew.y - x_.y * d, askew.z - x_.z * d});
    z_ = vectors::cross(x_, y_);
    const Vectors<Numbers> corner = widened(volumes.corner);
    corner_ = {model.origin[0] + corner.x * model.unit, model.origin[1] + corner.y * model.unit,
               model.origin[2] + corner.z * model.unit};
    for (int k = 0; k < 2; ++k) sides_[k] = widened(volumes.sides[k]) * model.unit;
    const Numbers fitted_radius = widened(volumes.radius) * model.unit;
    // The rounding errors of the fit's operations are relative to the sides and the diameter.
    constexpr double kOperations = 1. / (1 << 16);
    const Numbers margin = model.error + kOperations * (sides_[0] + sides_[1] + 2 * fitted_radius);
    radius_ = fitted_radius + margin;
    corner_sum_ = coordinateSum(corner_) + radius_ + sides_[0] + sides_[1];
    if constexpr (kWithBox) setBox(volumes, model, fitted_radius, margin);
  }

  /// Writes lane i of this half to the contiguous numbers of FCL's RSS, or of its OBB and RSS.
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
  /// This half of the lanes, in double precision.
  ADAPTIVE_BVH_INLINE static Numbers widened(const P& v) {
    return Lanes<P>::template widened<kHalf>(v);
  }
  ADAPTIVE_BVH_INLINE static Vectors<Numbers> widened(const Vectors<P>& v) {
    return {widened(v.x), widened(v.y), widened(v.z)};
  }
  /// Normalizes vectors whose lengths differ from 1 by at most 1e-5, by the Taylor series of 1 /
  /// sqrt(1 + d), whose next term is below 1e-14.
  ADAPTIVE_BVH_INLINE static Vectors<Numbers> unitVectors(const Vectors<Numbers>& v) {
    const Numbers d = vectors::dot(v, v) - 1;
    return vectors::scaled<Numbers>(v, 1 - d * (0.5 - d * 0.375));
  }
  /// |x| + |y| + |z|.
  ADAPTIVE_BVH_INLINE static Numbers coordinateSum(const Vectors<Numbers>& v) {
    return packs::absolute<Numbers>(v.x) + packs::absolute<Numbers>(v.y) +
           packs::absolute<Numbers>(v.z);
  }
  /// Sets the box and includes it in `corner_sum_`.
  ADAPTIVE_BVH_INLINE void setBox(const BodyVolumes<P>& volumes, const ModelCoordinates& model,
                                  const Numbers& fitted_radius, const Numbers& margin) {
    const Numbers a = widened(volumes.to_middle[0]) * model.unit,
                  b = widened(volumes.to_middle[1]) * model.unit;
    middle_ = {corner_.x + x_.x * a + y_.x * b, corner_.y + x_.y * a + y_.y * b,
               corner_.z + x_.z * a + y_.z * b};
    half_[0] = widened(volumes.half[0]) * model.unit;
    half_[1] = widened(volumes.half[1]) * model.unit;
    half_[2] = fitted_radius;
    const Numbers enlargement = margin + model.askew_axes * (half_[0] + half_[1] + half_[2]);
    for (Numbers& half : half_) half += enlargement;
    const Numbers longest =
        packs::upper<Numbers>(packs::upper<Numbers>(half_[0], half_[1]), half_[2]);
    corner_sum_ = packs::upper<Numbers>(corner_sum_, coordinateSum(middle_) + longest);
  }
  /// Writes lane i of four vectors. Returns the end of what it wrote.
  template <typename S>
  ADAPTIVE_BVH_INLINE static S* write(int i, const Vectors<Numbers>* const (&vectors)[4], S* to) {
    for (const Vectors<Numbers>* v : vectors) {
      *to++ = S(v->x[i]);
      *to++ = S(v->y[i]);
      *to++ = S(v->z[i]);
    }
    return to;
  }

  // In the model's units. The box has the half sides half_ around middle_.
  Vectors<Numbers> x_, y_, z_, corner_, middle_;
  Numbers sides_[2], radius_, corner_sum_, half_[3];
};

/// Writes the volume in lane i to the numbers to[i], for the first `count` lanes. Returns the
/// largest Volume::cornerSum. (Other lanes repeat the first one.)
template <bool kWithBox, typename P, typename S>
ADAPTIVE_BVH_INLINE double writeVolumes(const BodyVolumes<P>& volumes,
                                        const ModelCoordinates& model, S* const* to, int count) {
  constexpr int kHalfCount = Lanes<P>::kCount / 2;
  double largest = 0;
  const auto writeHalf = [&](const auto& half, int first) {
    for (int i = 0; i < kHalfCount; ++i) {
      if (first + i < count) half.write(i, to[first + i]);
      largest = half.cornerSum()[i] > largest ? half.cornerSum()[i] : largest;
    }
  };
  writeHalf(VolumeWriter<P, 0, kWithBox>(volumes, model), 0);
  if (count > kHalfCount) writeHalf(VolumeWriter<P, 1, kWithBox>(volumes, model), kHalfCount);
  return largest;
}

}  // namespace adaptive_bvh
