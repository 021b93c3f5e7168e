#include "volumes/kept_axes.h"

#include <cmath>

#include <Eigen/Geometry>

namespace adaptive_bvh {

PackedRotation::PackedRotation(const float (&x)[3], const float (&y)[3], const float (&z)[3]) {
  Eigen::Matrix3f rotation;
  rotation << x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2];
  const Eigen::Vector4f q = Eigen::Quaternionf(rotation).normalized().coeffs();
  for (int k = 0; k < 4; ++k)
    numbers_[k] = static_cast<std::int16_t>(std::lround(q[k] * float(kOne)));
}

}  // namespace adaptive_bvh
