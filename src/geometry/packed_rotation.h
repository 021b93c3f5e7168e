#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Geometry>

#include "geometry/axes4.h"

namespace adaptive_bvh {

/// A rotation in four bytes, off by less than 0.3 degrees: of its unit quaternion the
/// three smaller components, in ten bits each, and which one is the largest.
class PackedRotation {
 public:
  PackedRotation() : PackedRotation(Axes4()) {}
  explicit PackedRotation(const Axes4& axes) {
    Eigen::Matrix3f m;
    m << axes.x[0], axes.y[0], axes.z[0], axes.x[1], axes.y[1], axes.z[1], axes.x[2], axes.y[2],
        axes.z[2];
    const Eigen::Vector4f q = Eigen::Quaternionf(m).normalized().coeffs();
    int largest = 0;
    q.cwiseAbs().maxCoeff(&largest);
    bits_ = static_cast<std::uint32_t>(largest);
    const float sign = q[largest] < 0 ? -1.f : 1.f;  // q and -q are one rotation
    for (int k = 1; k < 4; ++k) {
      const float share = sign * q[(largest + k) % 4] * kScale + kMiddle;
      const float bounded = std::min(std::max(share, 0.f), 1023.f);
      bits_ = bits_ << 10 | static_cast<std::uint32_t>(std::lround(bounded));
    }
  }

  Axes4 axes() const {
    const auto part = [&](int shift) {
      return (float((bits_ >> shift) & 1023) - kMiddle) * (1 / kScale);
    };
    const unsigned largest = bits_ >> 30;
    const float a = part(20), b = part(10), c = part(0);
    float q[4];
    q[(largest + 1) % 4] = a;
    q[(largest + 2) % 4] = b;
    q[(largest + 3) % 4] = c;
    q[largest] = std::sqrt(std::max(1 - a * a - b * b - c * c, 0.f));
    const float x = q[0], y = q[1], z = q[2], w = q[3];
    const float xx = 2 * x * x, yy = 2 * y * y, zz = 2 * z * z, xy = 2 * x * y, xz = 2 * x * z,
                yz = 2 * y * z, wx = 2 * w * x, wy = 2 * w * y, wz = 2 * w * z;
    Axes4 axes;
    axes.x = Float4{1 - yy - zz, xy + wz, xz - wy, 0};
    axes.y = Float4{xy - wz, 1 - xx - zz, yz + wx, 0};
    axes.z = Float4{xz + wy, yz - wx, 1 - xx - yy, 0};
    return axes;
  }

 private:
  static constexpr float kMiddle = 511.5f, kScale = 511.4f * 1.41421356f;

  std::uint32_t bits_;
};

}  // namespace adaptive_bvh
