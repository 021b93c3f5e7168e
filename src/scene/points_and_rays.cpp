#include <stdexcept>

#include "dispatch/convex_parts.h"
#include "query/points/point_search.h"
#include "query/points/ray_search.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

/// By so much of the coordinates a bound is smaller, for rounding.
constexpr double kCellRounding = 1e-12;

/// Makes `best` the nearest point of a mesh, if that is nearer.
template <typename S>
void improve(const Body<S>& body, const fcl::Transform3d& tf, const fcl::Vector3d& x,
             double& distance, ScenePoint<S>& best) {
  PointSearch::Nearest nearest;
  nearest.distance = distance;
  const fcl::Vector3d seen = tf.linear().transpose() * (x - tf.translation());
  PointSearch(stateOf(*body.mesh)).search(seen, nearest);
  if (nearest.triangle < 0 || !(nearest.distance < distance)) return;
  distance = nearest.distance;
  best = {body.id, static_cast<S>(distance), (tf * nearest.point).template cast<S>(),
          nearest.triangle};
}

/// Of a shape, or of an octree's cells.
template <typename S>
void improveByParts(const Body<S>& body, const fcl::Vector3d& x, double& distance,
                    ScenePoint<S>& best) {
  const auto bound = [&](const CellBall& ball) {
    const double rounding = kCellRounding * (x.norm() + ball.middle.norm());
    return (ball.middle - x).norm() - ball.radius - rounding;
  };
  ConvexParts(*body.geometry, body.tf.template cast<double>())
      .visit(
          bound, [&] { return distance; },
          [&](const ConvexPart& part) {
            const auto& [solid, tf] = part.placed;
            const ShapeSurface found =
                solid.surface(tf.linear().transpose() * (x - tf.translation()));
            if (!(std::fabs(found.distance) < distance)) return false;
            distance = std::fabs(found.distance);
            best = {body.id, static_cast<S>(distance), (tf * found.nearest).template cast<S>(),
                    int(part.id)};
            return false;
          });
}

/// The first t of the range, rounded to S, at which a line crosses the surface of a shape; infinite
/// where it does not.
template <typename S>
S crossing(const PlacedSolid& placed, const Line& line, const RayRange<S>& range) {
  const fcl::Matrix3d back = placed.tf.linear().transpose();
  const LineInterval found =
      placed.solid.along({back * (line.origin - placed.tf.translation()), back * line.direction});
  if (found.isEmpty()) return std::numeric_limits<S>::infinity();
  for (const double end : {found.enter, found.leave}) {
    const S t = static_cast<S>(end);
    if (t >= range.begin && t <= range.end && t < std::numeric_limits<S>::infinity())
      return t + S(0);  // not -0
  }
  return std::numeric_limits<S>::infinity();
}

/// A ray of a scene and its first hit so far.
template <typename S>
class SceneRay {
 public:
  SceneRay(const fcl::Vector3<S>& origin, const fcl::Vector3<S>& direction,
           const RayRange<S>& range)
      : origin_(origin),
        direction_(direction),
        line_{origin.template cast<double>(), direction.template cast<double>()},
        range_(range) {
    best_.hit = {std::numeric_limits<S>::infinity(), -1, 0, 0};
  }

  const Line& line() const { return line_; }
  const SceneRayHit<S>& best() const { return best_; }
  /// The t beyond which no hits are needed.
  double end() const { return double(std::min(best_.hit.t, range_.end)); }

  void test(const Body<S>& body) {
    if (!body.mesh) return testParts(body);
    const fcl::Matrix3<S> back = body.tf.linear().transpose();
    take(body.id, firstHit(*body.mesh, fcl::Vector3<S>(back * (origin_ - body.tf.translation())),
                           fcl::Vector3<S>(back * direction_), range_));
  }

 private:
  void testParts(const Body<S>& body) {
    const auto bound = [&](const CellBall& ball) {
      const double rounding = kCellRounding * (line_.origin.norm() + ball.middle.norm());
      const LineInterval in_ball = lineInBall<fcl::Vector3d>(
          line_.origin - ball.middle, line_.direction, ball.radius + rounding);
      return in_ball.isEmpty() || in_ball.leave < 0 ? kNone : std::max(in_ball.enter, 0.);
    };
    ConvexParts(*body.geometry, body.tf.template cast<double>())
        .visit(
            bound, [&] { return std::min(end(), std::numeric_limits<double>::max()); },
            [&](const ConvexPart& part) {
              take(body.id, {crossing(part.placed, line_, range_), int(part.id), 0, 0});
              return false;
            });
  }
  void take(BodyId body, const RayHit<S>& hit) {
    const bool is_smaller = body < best_.body && hit.t < std::numeric_limits<S>::infinity();
    if (hit.t < best_.hit.t || (hit.t == best_.hit.t && is_smaller)) best_ = {body, hit};
  }

  static constexpr double kNone = std::numeric_limits<double>::infinity();

  const fcl::Vector3<S>&origin_, &direction_;
  const Line line_;
  const RayRange<S>& range_;
  SceneRayHit<S> best_;
};

}  // namespace

template <typename S>
ScenePoint<S> Scene<S>::nearestPoint(const fcl::Vector3<S>& point) const {
  const State& state = *state_;
  state.requireCurrent();
  if (!point.allFinite()) throw std::invalid_argument("adaptive_bvh: a point is not finite");
  const fcl::Vector3d x{double(point[0]), double(point[1]), double(point[2])};
  ScenePoint<S> best;
  double distance = std::numeric_limits<double>::infinity();
  state.visitByDistance({x, x}, [&](const Body<S>& body) {
    if (body.mesh)
      improve(body, body.tf.template cast<double>(), x, distance, best);
    else
      improveByParts(body, x, distance, best);
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
    SceneRay<S> ray(origins[r], directions[r], range);
    for (const unsigned i : state.unbounded) ray.test(state.bodies[i]);
    state.tree.visitAlongRay(ray.line().origin, ray.line().direction, [&](unsigned i, double) {
      ray.test(state.bodies[state.in_tree[i]]);
      return State::slack(ray.end());
    });
    result[r] = ray.best();
  };
  forEachBatch(state.threads, count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) cast(r);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template ScenePoint<S> Scene<S>::nearestPoint(const fcl::Vector3<S>&) const;                   \
  template void Scene<S>::firstHits(const fcl::Vector3<S>*, const fcl::Vector3<S>*, std::size_t, \
                                    const RayRange<S>&, std::vector<SceneRayHit<S>>&) const;     \
  template void Scene<S>::firstHits(const fcl::Vector3<S>*, const fcl::Vector3<S>*, std::size_t, \
                                    std::vector<SceneRayHit<S>>&) const;
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
