// The first impact of a scene's bodies in a step: searches the pairs whose swept boxes overlap.
#include <algorithm>
#include <array>
#include <limits>

#include "base/leased.h"
#include "base/rigid.h"
#include "base/task_pool.h"
#include "ccd/moving_parts.h"
#include "ccd/placed_motion.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

/// Vertex positions at the start of the step.
const std::vector<fcl::Vector3d>& startOf(const MeshState& mesh) {
  return mesh.previous.empty() ? mesh.vertices : mesh.previous;
}

/// The motion of a mesh in the step.
PlacedMotion motionOf(const Body& body, PlacedMotion::Memory& memory) {
  const MeshState& mesh = body.mesh();
  return {mesh, startOf(mesh).data(), mesh.vertices.data(), body.start_tf, body.tf, memory};
}

WorldBox unionOf(const WorldBox& a, const WorldBox& b) {
  return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}

/// The box around a mesh's motion: its start and its end, because vertices move on straight lines.
WorldBox sweptBoxOfMesh(const Body& body) {
  fcl::Vector3d low = body.box.low, high = body.box.high;
  for (const fcl::Vector3d& x : startOf(body.mesh())) {
    const fcl::Vector3d start = body.start_tf * x;
    low = low.cwiseMin(start);
    high = high.cwiseMax(start);
  }
  // For the rounding of positions in the world.
  const double margin = std::numeric_limits<double>::epsilon() * 8 *
                        low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff();
  return {low.array() - margin, high.array() + margin};
}

/// The box around a body's motion; unbounded for a plane or half-space.
WorldBox sweptBoxOf(const Body& body, double turn_error) {
  if (body.isMesh()) return sweptBoxOfMesh(body);
  return body.box.isBounded() ? unionOf(body.box, boxAround(body, body.start_tf, turn_error))
                              : body.box;
}

/// The moving convex parts of a body: triangles, a shape, or cells of an octree.
struct MovingParts {
  std::vector<MovingPart> parts;
  std::vector<WorldBox> boxes;    ///< around the motion of each part
  std::vector<unsigned> numbers;  ///< triangles or cells; SceneImpact::kNoFeature for a shape

  void add(const MovingPart& part, const WorldBox& box, unsigned number) {
    parts.push_back(part);
    boxes.push_back(box);
    numbers.push_back(number);
  }
};

/// Calls use(parts) with the triangles of a mesh that may come within `separation` of a box.
template <typename Use>
void withTriangles(const Body& body, const WorldBox& other, double separation, const Use& use) {
  MovingParts found;
  const MeshState& mesh = body.mesh();
  const auto corners = [](const fcl::Transform3d& tf, const std::vector<fcl::Vector3d>& positions,
                          const fcl::Triangle& t) -> TrianglePoints<double> {
    return {tf * positions[t[0]], tf * positions[t[1]], tf * positions[t[2]]};
  };
  for (std::size_t i = 0; i < mesh.topology->triangles.size(); ++i) {
    const fcl::Triangle& t = mesh.topology->triangles[i];
    const TrianglePoints<double> start = corners(body.start_tf, startOf(mesh), t),
                                 end = corners(body.tf, mesh.vertices, t);
    WorldBox box{start[0], start[0]};
    for (const auto* points : {&start, &end})
      for (const fcl::Vector3d& x : *points) box = unionOf(box, {x, x});
    if (gapOf(box, other) <= separation)
      found.add(MovingPart(start, end), box, static_cast<unsigned>(i));
  }
  use(found);
}

/// Calls use(parts) with a shape, whose motion is in `box`, or with the cells of an octree that may
/// come within `separation` of another box.
template <typename Use>
void withShapes(const Body& body, const WorldBox& box, const WorldBox& other, double separation,
                const Use& use) {
  MovingParts found;
  const auto boxOf = [&](const CellBall& ball) -> WorldBox {
    const fcl::Vector3d a = body.start_tf * ball.middle, b = body.tf * ball.middle;
    const double margin = ball.radius + 1e-12 * (a.norm() + b.norm());
    return {a.cwiseMin(b).array() - margin, a.cwiseMax(b).array() + margin};
  };
  const auto bound = [&](const CellBall& ball) {
    return gapOf(boxOf(ball), other) <= separation ? 0. : kNone;
  };
  const bool is_octree = body.geometry.kind() == ObjectKind::Octree;
  const QueryObject object(body.geometry.at(fcl::Transform3d::Identity()));
  object.parts().visit(
      bound, [] { return 0.; },
      [&](const ConvexPart& part) {
        const auto& [solid, tf] = part.placed;
        if (!is_octree) {
          found.add(MovingPart(solid, body.start_tf, body.tf), box, SceneImpact::kNoFeature);
          use(found);
          return false;
        }
        const fcl::Vector3d half = solid.support(fcl::Vector3d::Ones());
        found.add(MovingPart(BoxSolid(half), body.start_tf * tf, body.tf * tf),
                  boxOf({tf.translation(), 1.01 * half.norm()}), static_cast<unsigned>(part.id));
        return false;
      });
  if (is_octree) use(found);
}

/// The first impact of a part of one body with a part of another.
Impact firstContact(const MovingParts& first, const MovingParts& second, double separation,
                    double parallel) {
  Impact best;
  const auto test = [&](std::size_t i, std::size_t j) {
    const double latest = std::min(best.time, 1.);
    const double time =
        timeOfContact(first.parts[i], second.parts[j], separation, latest, parallel);
    const FeaturePair pair{first.numbers[i], second.numbers[j]};
    if (time < best.time || (time == best.time && pair < best.pair)) best = {time, {}, pair};
  };
  if (first.parts.size() == 1 || second.parts.size() == 1) {
    for (std::size_t i = 0; i < first.parts.size(); ++i)
      for (std::size_t j = 0; j < second.parts.size(); ++j) test(i, j);
    return best;
  }
  if (first.parts.empty() || second.parts.empty()) return best;
  BodyTree tree;
  tree.update(second.boxes);
  for (std::size_t i = 0; i < first.parts.size(); ++i)
    tree.visitByDistance(first.boxes[i], [&](unsigned j, double gap) {
      if (gap <= separation) test(i, j);
      return separation;
    });
  return best;
}

/// A body, and the box around its motion.
struct SweptBody {
  const Body& body;
  const WorldBox& box;
};

/// The first impact of two bodies, at least one of which is not a mesh.
Impact convexImpact(const SweptBody& a, const SweptBody& b, double separation) {
  Impact best;
  const auto withParts = [&](const SweptBody& swept, const WorldBox& other, const auto& use) {
    swept.body.isMesh() ? withTriangles(swept.body, other, separation, use)
                        : withShapes(swept.body, swept.box, other, separation, use);
  };
  withParts(a, b.box, [&](const MovingParts& first) {
    withParts(b, a.box, [&](const MovingParts& second) {
      best = firstContact(first, second, separation, a.body.geometry.parallel());
    });
  });
  return best;
}

/// The first impact of two bodies, or of a mesh with itself.
Impact impactOf(const SweptBody& a, const SweptBody& b, double separation) {
  if (!a.body.isMesh() || !b.body.isMesh()) return convexImpact(a, b, separation);
  const Leased<std::array<PlacedMotion::Memory, 2>> memory;
  const PlacedMotion first(motionOf(a.body, (*memory)[0]));
  if (&a.body == &b.body) return findEarliestImpact(first.withItself(separation));
  const PlacedMotion second(motionOf(b.body, (*memory)[1]));
  return findEarliestImpact(first.with(second, separation));
}

/// Memory of findSweptPairs, reused from call to call.
struct SweptBodies {
  std::vector<unsigned> bounded, unbounded;  ///< indices of bodies
  std::vector<WorldBox> boxes;               ///< of the bounded bodies
  BodyTree tree;
};

/// Memory of earliestImpact, reused from call to call.
struct ImpactMemory {
  std::vector<WorldBox> boxes;  ///< by index of the body
  std::vector<BodyPair> pairs, with_themselves;
  std::vector<Impact> impacts;  ///< by pair
};

}  // namespace

void SceneState::findSweptPairs(const std::vector<WorldBox>& all_boxes, double distance,
                                std::vector<BodyPair>& pairs) const {
  const Leased<SweptBodies> memory;
  SweptBodies& swept = *memory;
  swept.bounded.clear();
  swept.unbounded.clear();
  swept.boxes.clear();
  pairs.clear();
  for (unsigned i = 0; i < bodies.size(); ++i) {
    (all_boxes[i].isBounded() ? swept.bounded : swept.unbounded).push_back(i);
    if (all_boxes[i].isBounded()) swept.boxes.push_back(all_boxes[i]);
  }
  const auto add = [&](unsigned a, unsigned b) {
    if (admits(bodies[a], bodies[b])) pairs.push_back({std::min(a, b), std::max(a, b)});
  };
  if (!swept.boxes.empty()) {
    swept.tree.update(swept.boxes);
    swept.tree.forEachPair(
        slack(distance), [&](unsigned i, unsigned j) { add(swept.bounded[i], swept.bounded[j]); });
  }
  for (const unsigned a : swept.unbounded) {
    for (const unsigned b : swept.bounded) add(a, b);
    for (const unsigned b : swept.unbounded)
      if (b < a) add(a, b);
  }
  std::sort(pairs.begin(), pairs.end());
}

SceneImpact SceneState::earliestImpact(double separation) const {
  requireSeparation(separation);
  requireCurrent();
  const Leased<ImpactMemory> memory;
  ImpactMemory& swept = *memory;
  swept.boxes.clear();
  swept.with_themselves.clear();
  for (unsigned i = 0; i < bodies.size(); ++i) {
    swept.boxes.push_back(sweptBoxOf(bodies[i], turnError()));
    if (bodies[i].options.self_collision) swept.with_themselves.push_back({i, i});
  }
  findSweptPairs(swept.boxes, separation, swept.pairs);
  swept.pairs.insert(swept.pairs.end(), swept.with_themselves.begin(), swept.with_themselves.end());
  std::sort(swept.pairs.begin(), swept.pairs.end());
  swept.impacts.assign(swept.pairs.size(), Impact());
  const TaskPool pool(swept.pairs.size() > 1 ? threads : 1);
  pool.forEach(static_cast<int>(swept.pairs.size()), [&](int task, int) {
    const auto pair = static_cast<std::size_t>(task);
    const auto [a, b] = swept.pairs[pair];
    swept.impacts[pair] =
        impactOf({bodies[a], swept.boxes[a]}, {bodies[b], swept.boxes[b]}, separation);
  });
  SceneImpact best;
  for (std::size_t i = 0; i < swept.pairs.size(); ++i) {
    if (!(swept.impacts[i].time < best.impact.time)) continue;
    best.impact = swept.impacts[i];
    best.bodies = {bodies[swept.pairs[i].first].id, bodies[swept.pairs[i].second].id};
  }
  return best;
}

}  // namespace adaptive_bvh
