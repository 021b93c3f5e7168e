#pragma once

#include <fcl/common/types.h>

#include "base/box.h"
#include "base/vectors.h"

namespace adaptive_bvh {

/// A change of frame y' = m y + t of four boxes or points at once, where m is a rotation times a
/// scale, in single precision. A box is mapped to the bounding box of its image, enlarged by
/// `margin` on all sides; points are mapped without a margin.
class FrameChange {
 public:
  FrameChange() = default;
  FrameChange(const fcl::Matrix3d& m, const fcl::Vector3d& t, double margin = 0)
      : margin_(float4::all(static_cast<float>(margin))) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        m_[i][k] = float4::all(static_cast<float>(m(i, k)));
        absolute_[i][k] = float4::absolute(m_[i][k]);
      }
      t_[i] = float4::all(static_cast<float>(t[i]));
    }
  }

  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const {
    const Float4 half = float4::all(0.5f);
    Float4 center[3], half_side[3];
    for (int k = 0; k < 3; ++k) {
      center[k] = (boxes.low[k] + boxes.high[k]) * half;
      half_side[k] = (boxes.high[k] - boxes.low[k]) * half;
    }
    Boxes4 image;
    for (int i = 0; i < 3; ++i) {
      const Float4 c = t_[i] + m_[i][0] * center[0] + m_[i][1] * center[1] + m_[i][2] * center[2];
      const Float4 s = margin_ + absolute_[i][0] * half_side[0] + absolute_[i][1] * half_side[1] +
                       absolute_[i][2] * half_side[2];
      image.low[i] = c - s;
      image.high[i] = c + s;
    }
    return image;
  }

  ADAPTIVE_BVH_INLINE Vector4x3 operator()(const Vector4x3& points) const {
    const auto component = [&](int i) -> Float4 {
      return t_[i] + m_[i][0] * points.x + m_[i][1] * points.y + m_[i][2] * points.z;
    };
    return {component(0), component(1), component(2)};
  }

 private:
  /// The numbers of m, their absolute values, t and the margin, each repeated in four lanes.
  Float4 m_[3][3], absolute_[3][3], t_[3], margin_;
};

}  // namespace adaptive_bvh
