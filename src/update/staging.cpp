#include "update/staging.h"

#include <algorithm>
#include <cmath>

#include "volume/rounding.h"

namespace adaptive_bvh {
namespace {

void store(const Lanes& lanes, float (&to)[3]) {
  for (int k = 0; k < 3; ++k) to[k] = lanes[k];
}

}  // namespace

template <typename BV>
typename BV::S stageVertices(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             const fcl::Vector3<typename BV::S>* positions) {
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  // Measured from where the volumes last held the vertex: the frame before, also in swept mode.
  const Point* from = model.prev_vertices ? model.prev_vertices : model.vertices;
  const BodyFrame<S> frame = boxes.frame;
  S squared = 0;
  bool moved = false;
  for (int v = 0; v < model.num_vertices; ++v) {
    const Point to = positions[v];
    const Point d = to - from[v];
    const S d2 = d.squaredNorm();
    moved |= !(d[0] == 0 && d[1] == 0 && d[2] == 0);
    if (!std::isnan(squared)) squared = std::max(d2, squared);  // in this order NaN wins, and stays
    StagedVertex& staged = boxes.staged(static_cast<unsigned>(v));
    store(frame.place(to), staged.at);
    store(frame.displacement(from[v], to), staged.motion);
    model.vertices[v] = to;
  }
  if (!moved) return 0;
  return std::sqrt(squared) * (1 + 4 * rounding::epsilon<S>()) + rounding::tiny<S>();
}

template <typename BV>
void stageInPlace(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes) {
  for (int v = 0; v < model.num_vertices; ++v) {
    StagedVertex& staged = boxes.staged(static_cast<unsigned>(v));
    store(boxes.frame.place(model.vertices[v]), staged.at);
    store(Lanes::Zero(), staged.motion);
  }
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                         \
  template S stageVertices(fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&, const fcl::Vector3<S>*); \
  template void stageInPlace(const fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
