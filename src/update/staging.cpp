#include "update/staging.h"

#include <algorithm>
#include <cmath>

#include "update/local_bounds.h"
#include "volume/rounding.h"

namespace adaptive_bvh {
template <typename BV>
typename BV::S stageVertices(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             const fcl::Vector3<typename BV::S>* positions) {
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  // Measured from where the volumes last held the vertex: the frame before, also in swept mode.
  const Point* from = model.prev_vertices ? model.prev_vertices : model.vertices;
  const BodyFrame<S> frame = boxes.frame;
  S squared = 0, sum = 0;
  Point low = positions[0], high = positions[0];
  for (int v = 0; v < model.num_vertices; ++v) {
    const Point to = positions[v], d = to - from[v];
    const S d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    squared = std::max(squared, d2);
    sum += d2;
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], to[k]);
      high[k] = std::max(high[k], to[k]);
    }
    StagedVertex& staged = boxes.staged[static_cast<std::size_t>(v)];
    lanes::store(frame.place(to), staged.at);
    lanes::store(frame.displacement(d), staged.motion);
    model.vertices[v] = to;
  }
  setLocalBounds(model, low, high);
  if (model.prev_vertices) {
    boxes.before.resize(static_cast<std::size_t>(model.num_vertices));
    for (int v = 0; v < model.num_vertices; ++v)
      lanes::store(frame.place(model.prev_vertices[v]),
                   boxes.before[static_cast<std::size_t>(v)].data());
  }
  if (!std::isfinite(sum)) return sum;  // the old positions were no numbers
  return std::sqrt(squared) * (1 + 4 * rounding::epsilon<S>()) + rounding::tiny<S>();
}

template <typename BV>
void stageInPlace(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes) {
  for (int v = 0; v < model.num_vertices; ++v) {
    StagedVertex& staged = boxes.staged[static_cast<std::size_t>(v)];
    lanes::store(boxes.frame.place(model.vertices[v]), staged.at);
    lanes::store(lanes::all(0), staged.motion);
  }
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                         \
  template S stageVertices(fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&, const fcl::Vector3<S>*); \
  template void stageInPlace(const fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
