#include "update/local_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/math/bv/RSS.h>

namespace adaptive_bvh {

template <typename BV>
void setLocalBox(fcl::BVHModel<BV>& model, const fcl::Vector3<typename BV::S>& low,
                 const fcl::Vector3<typename BV::S>& high) {
  model.aabb_local.min_ = low;
  model.aabb_local.max_ = high;
  model.aabb_center = model.aabb_local.center();
}

template <typename BV>
typename BV::S squaredRadius(const fcl::BVHModel<BV>& model, int begin, int end) {
  using S = typename BV::S;
  const S x = model.aabb_center[0], y = model.aabb_center[1], z = model.aabb_center[2];
  S squared = 0;
  for (int v = begin; v < end; ++v) {
    const S dx = model.vertices[v][0] - x, dy = model.vertices[v][1] - y,
            dz = model.vertices[v][2] - z;
    squared = std::max(squared, dx * dx + dy * dy + dz * dz);
  }
  return squared;
}

template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model) {
  using S = typename BV::S;
  fcl::Vector3<S> low = fcl::Vector3<S>::Constant(std::numeric_limits<S>::max()), high = -low;
  for (int v = 0; v < model.num_vertices; ++v)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], model.vertices[v][k]);
      high[k] = std::max(high[k], model.vertices[v][k]);
    }
  setLocalBox(model, low, high);
  model.aabb_radius = std::sqrt(squaredRadius(model, 0, model.num_vertices));
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                              \
  template void updateLocalBounds(fcl::BVHModel<fcl::RSS<S>>&);                  \
  template void setLocalBox(fcl::BVHModel<fcl::RSS<S>>&, const fcl::Vector3<S>&, \
                            const fcl::Vector3<S>&);                             \
  template S squaredRadius(const fcl::BVHModel<fcl::RSS<S>>&, int, int);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
