#pragma once

#include <fcl/common/types.h>

#include "base/box.h"
#include "base/vectors.h"

namespace adaptive_bvh {

/// A change of frame y' = M y + t, where M is a rotation times a scale. A box is mapped to the
/// bounding box of its image, enlarged by `margin` on all sides.
class FrameChange {
 public:
  FrameChange() = default;
  FrameChange(const fcl::Matrix3d& m, const fcl::Vector3d& t, double margin = 0)
      : margin_(float4::all(static_cast<float>(margin))) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        m_[i][k] = float4::all(static_cast<float>(m(i, k)));
        sizes_[i][k] = float4::absolute(m_[i][k]);
      }
      t_[i] = float4::all(static_cast<float>(t[i]));
    }
  }

  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const {
    const Float4 half = float4::all(0.5f);
    Float4 center[3], side[3];
    for (int k = 0; k < 3; ++k) {
      center[k] = (boxes.low[k] + boxes.high[k]) * half;
      side[k] = (boxes.high[k] - boxes.low[k]) * half;
    }
    Boxes4 turned;
    for (int i = 0; i < 3; ++i) {
      const Float4 c = t_[i] + m_[i][0] * center[0] + m_[i][1] * center[1] + m_[i][2] * center[2];
      const Float4 s =
          margin_ + sizes_[i][0] * side[0] + sizes_[i][1] * side[1] + sizes_[i][2] * side[2];
      turned.low[i] = c - s;
      turned.high[i] = c + s;
    }
    return turned;
  }

  ADAPTIVE_BVH_INLINE Vector4x3 operator()(const Vector4x3& points) const {
    const auto along = [&](int i) -> Float4 {
      return t_[i] + m_[i][0] * points.x + m_[i][1] * points.y + m_[i][2] * points.z;
    };
    return {along(0), along(1), along(2)};
  }

 private:
  Float4 m_[3][3], sizes_[3][3], t_[3], margin_;
};

}  // namespace adaptive_bvh
