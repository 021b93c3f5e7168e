#include "volumes/local_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/math/bv/RSS.h>

#include "mesh/vertex_summary.h"
#include "volumes/each_volume.h"

namespace adaptive_bvh {
namespace {

/// The squared distance from a point. Written out, because Eigen adds in another order.
template <typename S>
class SquaredLength {
 public:
  explicit SquaredLength(const fcl::Vector3<S>& from) : x_(from[0]), y_(from[1]), z_(from[2]) {}
  S operator()(const fcl::Vector3<S>& p) const {
    const S dx = p[0] - x_, dy = p[1] - y_, dz = p[2] - z_;
    return dx * dx + dy * dy + dz * dz;
  }

 private:
  S x_, y_, z_;
};

}  // namespace

template <typename BV>
typename BV::S writePositions(fcl::BVHModel<BV>& model,
                              const fcl::Vector3<typename BV::S>* positions, int begin, int end) {
  typename BV::S squared = 0;
  const SquaredLength<typename BV::S> from_center(model.aabb_center);
  for (int v = begin; v < end; ++v) {
    model.vertices[v] = positions[v];
    squared = std::max(squared, from_center(positions[v]));
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
  setLocalBox<S>(model, low, high);
  S squared = 0;
  const SquaredLength<S> from_center(model.aabb_center);
  for (int v = 0; v < model.num_vertices; ++v)
    squared = std::max(squared, from_center(model.vertices[v]));
  model.aabb_radius = std::sqrt(squared);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                   \
  template void updateLocalBounds(fcl::BVHModel<BV>&); \
  template BV::S writePositions(fcl::BVHModel<BV>&, const fcl::Vector3<BV::S>*, int, int);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
