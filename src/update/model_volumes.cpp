#include "update/model_volumes.h"

#include "geometry/vectors.h"

namespace adaptive_bvh {
namespace {

using Numbers = Pack<double>;
constexpr int kAtOnce = int(packs::kSize<double>);

/// Vectors as long as 1 up to rounding, from some that are up to 1e-5: the series of 1 / sqrt(n)
/// about 1, whose next term is below 1e-15.
ADAPTIVE_BVH_INLINE Vectors<Numbers> unitVectors(const Vectors<Numbers>& v) {
  const Numbers d = vectors::dot(v, v) - 1;
  return vectors::scaled<Numbers>(v, 1 - d * (0.5 - d * 0.375));
}

ADAPTIVE_BVH_INLINE Numbers lanes(const Float4& v, int first) {
  return Numbers{double(v[first]), double(v[first + 1])};
}
ADAPTIVE_BVH_INLINE Vectors<Numbers> turned(const fcl::Matrix3d& frame, const float4::Columns& v,
                                            int first) {
  const Numbers x = lanes(v.x, first), y = lanes(v.y, first), z = lanes(v.z, first);
  const auto row = [&](int k) -> Numbers {
    return frame(k, 0) * x + frame(k, 1) * y + frame(k, 2) * z;
  };
  return {row(0), row(1), row(2)};
}

}  // namespace

/// Let e be the extent, u = 2^-24. A point of the body is off by less than 35 u e, and the corner
/// by 8 u e: 2 kError e = 64 u e covers both.
template <typename BV>
ModelVolumes<BV>::ModelVolumes(const BodyFrame<S>& frame, float extent)
    : frame_(frame),
      unit_(frame.unit()),
      error_(2 * S(BodyFrame<S>::kError) * (S(extent) * unit_) +
             16 * rounding::epsilon<S>() *
                 (frame.origin().template lpNorm<1>() + 8 * (S(extent) * unit_)) +
             rounding::tiny<S>()) {}

/// What operations round is relative to the sides and the diameter: axes that are orthonormal to 90
/// u only, twice that, and 16 u for local coordinates, distances and the corner.
template <typename BV>
void ModelVolumes<BV>::write(const BodyVolume (&volumes)[kLanes], BV* const* to, int count) const {
  constexpr float kOperations = 1.f / (1 << 16);
  const auto columns = [&](auto&& part) -> float4::Columns {
    return float4::columns(part(volumes[0]), part(volumes[1]), part(volumes[2]), part(volumes[3]));
  };
  const float4::Columns axis0 = columns([](const BodyVolume&v) -> Float4 { return v.axes.x; }),
                        axis1 = columns([](const BodyVolume&v) -> Float4 { return v.axes.y; }),
                        corner = columns([](const BodyVolume&v) -> Float4 { return v.corner; });
  for (int first = 0; first < count; first += kAtOnce) {
    const Vectors<Numbers> x = unitVectors(turned(frame_.axes(), axis0, first)),
                           askew = turned(frame_.axes(), axis1, first);
    const Numbers d = vectors::dot(x, askew);
    const Vectors<Numbers> y =
        unitVectors({askew.x - x.x * d, askew.y - x.y * d, askew.z - x.z * d});
    const Vectors<Numbers> z = vectors::cross(x, y),
                           from_origin = turned(frame_.axes(), corner, first);
    for (int k = 0; k < kAtOnce && first + k < count; ++k) {
      fcl::Matrix3<S> axes;
      axes << S(x.x[k]), S(y.x[k]), S(z.x[k]), S(x.y[k]), S(y.y[k]), S(z.y[k]), S(x.z[k]),
          S(y.z[k]), S(z.z[k]);
      const fcl::Vector3<S> at(frame_.origin()[0] + S(from_origin.x[k]) * unit_,
                               frame_.origin()[1] + S(from_origin.y[k]) * unit_,
                               frame_.origin()[2] + S(from_origin.z[k]) * unit_);
      const Extents& extents = volumes[first + k].extents;
      const float operations =
          kOperations * (extents.sides[0] + extents.sides[1] + 2 * extents.radius);
      Volume<BV>::setAlong(*to[first + k], axes, at, extents, unit_,
                           error_ + S(operations) * unit_);
    }
  }
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class ModelVolumes<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
