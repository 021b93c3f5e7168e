#include "update/displacement.h"

#include <algorithm>
#include <cmath>

namespace adaptive_bvh {

template <typename S>
bool usablePositions(const fcl::Vector3<S>* positions, std::size_t count) {
  const S limit = rounding::largestCoordinate<S>();
  bool usable = true;
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) usable &= std::abs(positions[i][k]) <= limit;  // false for NaN
  return usable;
}

template <typename BV>
typename BV::S moveVertices(fcl::BVHModel<BV>& model, Tracking<BV>& tracking,
                            const fcl::Vector3<typename BV::S>* positions) {
  using S = typename BV::S;
  S largest = 0;
  for (int v = 0; v < model.num_vertices; ++v) {
    // Measured from where the volumes last held the vertex: the frame before, also in swept mode.
    const fcl::Vector3<S>& old = model.prev_vertices ? model.prev_vertices[v] : model.vertices[v];
    const S d = rounding::norm<S>(positions[v] - old);
    tracking.vertex_motion[v] = d;
    if (!std::isnan(largest)) largest = std::max(d, largest);  // in this order NaN wins, and stays
    model.vertices[v] = positions[v];
  }

  const MeshView<S> mesh = viewOf(model);
  const int corners = mesh.verticesPerPrimitive();
  for (unsigned p = 0; p < tracking.latest.size(); ++p) {
    S latest = 0;
    for (int k = 0; k < corners; ++k)
      latest = std::max(latest, tracking.vertex_motion[mesh.vertex(p, k)]);
    tracking.latest[p] = latest;
    if (latest == 0) continue;  // as far from its reference as it was
    // In swept mode of both frames: the leaf must hold both.
    S overall = 0;
    for (int k = 0; k < corners; ++k) {
      const unsigned v = mesh.vertex(p, k);
      const fcl::Vector3<S>& from = tracking.reference[p][k];
      overall = std::max(overall, rounding::norm<S>(mesh.vertices[v] - from));
      if (mesh.previous) overall = std::max(overall, rounding::norm<S>(mesh.previous[v] - from));
    }
    tracking.overall[p] = overall;
  }
  return largest;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                            \
  template bool usablePositions(const fcl::Vector3<S>*, std::size_t);          \
  template S moveVertices(fcl::BVHModel<fcl::RSS<S>>&, Tracking<fcl::RSS<S>>&, \
                          const fcl::Vector3<S>*);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
