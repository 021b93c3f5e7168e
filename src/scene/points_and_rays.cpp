// Nearest points of a scene's bodies, and first hits of rays.
#include <cmath>

#include "dispatch/convex_parts.h"
#include "query/points/point_search.h"
#include "query/points/ray_search.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

/// Rounding error of a bound, relative to the coordinates.
constexpr double kCellRounding = 1e-12;

/// Sets `best` to the nearest point of a mesh if it is nearer.
void improve(const Body& body, const fcl::Vector3d& x, ScenePoint& best) {
  PointSearch::Nearest nearest;
  nearest.distance = best.distance;
  const fcl::Vector3d in_body = body.tf.linear().transpose() * (x - body.tf.translation());
  PointSearch(body.mesh()).search(in_body, nearest);
  if (nearest.triangle < 0 || !(nearest.distance < best.distance)) return;
  best = {body.id, nearest.distance, body.tf * nearest.point, nearest.triangle};
}

/// Sets `best` to the nearest point of a shape or of an octree's cells if it is nearer.
void improveByParts(const Body& body, const fcl::Vector3d& x, ScenePoint& best) {
  const auto bound = [&](const CellBall& ball) {
    const double rounding = kCellRounding * (x.norm() + ball.middle.norm());
    return (ball.middle - x).norm() - ball.radius - rounding;
  };
  const QueryObject object(body.object());
  object.parts().visit(
      bound, [&] { return best.distance; },
      [&](const ConvexPart& part) {
        const auto& [solid, tf] = part.placed;
        const ShapeSurface found = solid.surface(tf.linear().transpose() * (x - tf.translation()));
        const double distance = std::fabs(found.distance);
        if (distance < best.distance)
          best = {body.id, distance, tf * found.nearest, static_cast<int>(part.id)};
        return false;
      });
}

/// A ray in the world, and its first hit with the bodies tested so far.
class SceneRay {
 public:
  SceneRay(const Line& line, const RayRange& range) : line_(line), range_(range) {}

  const Line& line() const { return line_; }
  const SceneRayHit& best() const { return best_; }
  /// The t beyond which hits do not matter.
  double end() const { return std::min(best_.t, range_.end); }

  void test(const Body& body) { body.isMesh() ? testMesh(body) : testParts(body); }

 private:
  void testMesh(const Body& body) {
    const fcl::Matrix3d to_body = body.tf.linear().transpose();
    const fcl::Vector3d origin = to_body * (line_.origin - body.tf.translation()),
                        direction = to_body * line_.direction;
    requireRay(origin, direction);
    RayHit first = {kNone, -1, 0, 0};
    const auto keepFirst = [&](int triangle, const RayTriangle::Hit& hit) -> double {
      const double t = hit.t;
      if (isInRange(t) && (t < first.t || (t == first.t && triangle < first.triangle)))
        first = {t, triangle, hit.u, hit.v};
      return std::min(first.t, end());
    };
    RayWalk(body.mesh()).search(origin, direction, range_.begin, end(), keepFirst);
    keep(body.id, first);
  }
  void testParts(const Body& body) {
    const auto bound = [&](const CellBall& ball) {
      const double rounding = kCellRounding * (line_.origin.norm() + ball.middle.norm());
      const LineInterval in_ball = lineInBall<fcl::Vector3d>(
          line_.origin - ball.middle, line_.direction, ball.radius + rounding);
      return in_ball.isEmpty() || in_ball.leave < 0 ? kNone : std::max(in_ball.enter, 0.);
    };
    const QueryObject object(body.object());
    object.parts().visit(
        bound, [&] { return std::min(end(), std::numeric_limits<double>::max()); },
        [&](const ConvexPart& part) {
          keep(body.id, {crossing(part.placed), int(part.id), 0, 0});
          return false;
        });
  }
  /// The first t of the range at which the line crosses a shape's surface; infinite if none does.
  double crossing(const PlacedSolid& placed) const {
    const fcl::Matrix3d to_shape = placed.tf.linear().transpose();
    const LineInterval found = placed.solid.lineInside(
        {to_shape * (line_.origin - placed.tf.translation()), to_shape * line_.direction});
    if (found.isEmpty()) return kNone;
    for (const double end : {found.enter, found.leave})
      if (isInRange(end)) return end + 0.;  // not -0
    return kNone;
  }
  bool isInRange(double t) const { return t >= range_.begin && t <= range_.end && t < kNone; }
  /// Keeps a hit if it is the first one so far.
  void keep(BodyId body, const RayHit& hit) {
    const bool is_smaller = body < best_.body && hit.t < kNone;
    if (hit.t < best_.t || (hit.t == best_.t && is_smaller))
      best_ = {body, hit.t, hit.triangle, hit.u, hit.v};
  }

  static constexpr double kNone = std::numeric_limits<double>::infinity();

  const Line line_;
  const RayRange& range_;
  SceneRayHit best_;
};

}  // namespace

ScenePoint SceneState::nearestPoint(const fcl::Vector3d& point) const {
  requireCurrent();
  ScenePoint best;
  visitByDistance({point, point}, [&](const Body& body) {
    body.isMesh() ? improve(body, point, best) : improveByParts(body, point, best);
    return slack(best.distance);
  });
  return best;
}

void SceneState::firstHits(const fcl::Vector3d* origins, const fcl::Vector3d* directions,
                           std::size_t count, const RayRange& range,
                           std::vector<SceneRayHit>& result) const {
  requireCurrent();
  result.resize(count);
  const auto cast = [&](std::size_t r) {
    SceneRay ray({origins[r], directions[r]}, range);
    for (const unsigned i : unbounded) ray.test(bodies[i]);
    tree.visitAlongRay(origins[r], directions[r], [&](unsigned i, double) {
      ray.test(bodies[in_tree[i]]);
      return slack(ray.end());
    });
    result[r] = ray.best();
  };
  forEachBatch(threads, count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) cast(r);
  });
}

}  // namespace adaptive_bvh
