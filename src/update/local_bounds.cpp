#include "update/local_bounds.h"

#include <algorithm>
#include <cmath>

#include <fcl/math/bv/RSS.h>

namespace adaptive_bvh {

template <typename BV>
fcl::AABB<typename BV::S> boundsOf(const fcl::BVHModel<BV>& model) {
  fcl::AABB<typename BV::S> box;
  for (int v = 0; v < model.num_vertices; ++v) box += model.vertices[v];
  return box;
}

template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model) {
  using S = typename BV::S;
  model.aabb_local = boundsOf(model);
  const fcl::Vector3<S> center = model.aabb_local.center();
  S squared = 0;
  for (int v = 0; v < model.num_vertices; ++v)
    squared = std::max(squared, (model.vertices[v] - center).squaredNorm());
  model.aabb_center = center;
  model.aabb_radius = std::sqrt(squared);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                  \
  template fcl::AABB<S> boundsOf(const fcl::BVHModel<fcl::RSS<S>>&); \
  template void updateLocalBounds(fcl::BVHModel<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
