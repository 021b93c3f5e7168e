#include <stdexcept>

#include "query/point_search.h"
#include "query/ray_search.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {

template <typename S>
ScenePoint<S> Scene<S>::nearestPoint(const fcl::Vector3<S>& point) const {
  const State& state = *state_;
  state.requireCurrent();
  if (!point.allFinite()) throw std::invalid_argument("adaptive_bvh: a point is not finite");
  const fcl::Vector3d x{double(point[0]), double(point[1]), double(point[2])};
  ScenePoint<S> best;
  double distance = std::numeric_limits<double>::infinity();
  state.tree.visitByDistance({x, x}, [&](unsigned i, double) {
    const Body<S>& body = state.bodies[state.in_tree[i]];
    if (!body.mesh) return State::slack(distance);
    const fcl::Transform3d tf = body.tf.template cast<double>();
    typename PointSearch<S>::Nearest nearest;
    nearest.distance = distance;
    const fcl::Vector3d seen = tf.linear().transpose() * (x - tf.translation());
    PointSearch<S>(stateOf(*body.mesh)).search(seen, nearest);
    if (nearest.triangle >= 0 && nearest.distance < distance) {
      distance = nearest.distance;
      best = {body.id, static_cast<S>(distance), (tf * nearest.point).template cast<S>(),
              nearest.triangle};
    }
    return State::slack(distance);
  });
  return best;
}

template <typename S>
void Scene<S>::firstHits(const fcl::Vector3<S>* origins, const fcl::Vector3<S>* directions,
                         std::size_t count, const RayRange<S>& range,
                         std::vector<SceneRayHit<S>>& result) const {
  const State& state = *state_;
  state.requireCurrent();
  requireRange(range);
  for (std::size_t i = 0; i < count; ++i)
    if (!origins[i].allFinite() || !directions[i].allFinite() || directions[i].isZero(0))
      throw std::invalid_argument("adaptive_bvh: ray " + std::to_string(i) +
                                  " is not finite or has no direction");
  result.resize(count);
  const auto cast = [&](std::size_t r) {
    const fcl::Vector3d origin = origins[r].template cast<double>(),
                        direction = directions[r].template cast<double>();
    SceneRayHit<S> best;
    best.hit = {std::numeric_limits<S>::infinity(), -1, 0, 0};
    state.tree.visitAlongRay(origin, direction, [&](unsigned i, double) {
      const Body<S>& body = state.bodies[state.in_tree[i]];
      if (!body.mesh) return State::slack(double(std::min(best.hit.t, range.end)));
      const fcl::Matrix3<S> back = body.tf.linear().transpose();
      const RayHit<S> hit =
          firstHit(*body.mesh, fcl::Vector3<S>(back * (origins[r] - body.tf.translation())),
                   fcl::Vector3<S>(back * directions[r]), range);
      const bool is_nearer = hit.t < best.hit.t || (hit.t == best.hit.t && body.id < best.body);
      if (hit.triangle >= 0 && (best.hit.triangle < 0 || is_nearer)) best = {body.id, hit};
      return State::slack(double(std::min(best.hit.t, range.end)));
    });
    result[r] = best;
  };
  forEachBatch(state.threads, count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) cast(r);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template ScenePoint<S> Scene<S>::nearestPoint(const fcl::Vector3<S>&) const;                   \
  template void Scene<S>::firstHits(const fcl::Vector3<S>*, const fcl::Vector3<S>*, std::size_t, \
                                    const RayRange<S>&, std::vector<SceneRayHit<S>>&) const;
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
