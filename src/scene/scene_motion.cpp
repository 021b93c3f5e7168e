#include "base/leased.h"
#include "base/task_pool.h"
#include "ccd/moving_parts.h"
#include "dispatch/convex_parts.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

template <typename S>
Motion<S> motionOf(const Body<S>& body) {
  const auto& end = body.mesh->vertices();
  const auto& start = body.mesh->previousVertices().empty() ? end : body.mesh->previousVertices();
  return Motion<S>(*body.mesh, start, end, body.start_tf, body.tf);
}

WorldBox around(const WorldBox& a, const WorldBox& b) {
  return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}

/// Around a mesh where the step begins and where it ends. Vertices move on straight lines.
template <typename S>
WorldBox sweptBoxOfMesh(const Body<S>& body) {
  WorldBox box = body.box;
  const auto& previous = body.mesh->previousVertices();
  const auto& start = previous.empty() ? body.mesh->vertices() : previous;
  const fcl::Transform3d tf = body.start_tf.template cast<double>();
  fcl::Vector3d low = box.low, high = box.high;
  for (const fcl::Vector3<S>& x : start) {
    const fcl::Vector3d at = tf * x.template cast<double>();
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  // Positions in the world are rounded to S.
  const double margin = double(std::numeric_limits<S>::epsilon()) * 8 *
                        low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff();
  box.low = low.array() - margin;
  box.high = high.array() + margin;
  return box;
}

template <typename S>
WorldBox sweptBoxOf(const Body<S>& body) {
  if (body.mesh) return sweptBoxOfMesh(body);
  return body.box.isBounded() ? around(body.box, boxAround(body, body.start_tf)) : body.box;
}

/// The convex parts of a body in a step: triangles, a shape, or cells.
struct MovingParts {
  std::vector<MovingPart> parts;
  std::vector<WorldBox> boxes;    ///< of the ways of the parts
  std::vector<unsigned> numbers;  ///< of triangles and cells; FeaturePair's number of none

  void add(const MovingPart& part, const WorldBox& box, unsigned number) {
    parts.push_back(part);
    boxes.push_back(box);
    numbers.push_back(number);
  }
};

/// Calls use(parts) with the parts of a mesh that may be at most `separation` from a box.
template <typename S, typename Use>
void withTriangles(const Body<S>& body, const WorldBox& other, double separation, const Use& use) {
  MovingParts found;
  const Motion<S> motion = motionOf(body);
  const auto corners = [&](const fcl::Transform3<S>& tf, const fcl::Vector3<S>* positions,
                           const fcl::Triangle& t) -> TrianglePoints<double> {
    const auto corner = [&](int k) -> fcl::Vector3d {
      return tf.template cast<double>() * positions[t[std::size_t(k)]].template cast<double>();
    };
    return {corner(0), corner(1), corner(2)};
  };
  for (std::size_t i = 0; i < body.mesh->triangles().size(); ++i) {
    const fcl::Triangle& t = body.mesh->triangles()[i];
    const TrianglePoints<double> start = corners(body.start_tf, motion.start, t),
                                 end = corners(body.tf, motion.end, t);
    WorldBox box{start[0], start[0]};
    for (const auto* points : {&start, &end})
      for (const fcl::Vector3d& x : *points) box = around(box, {x, x});
    if (gapOf(box, other) <= separation)
      found.add(MovingPart(start, end), box, static_cast<unsigned>(i));
  }
  use(found);
}

/// Calls use(parts) with a shape, or with the cells of an octree that may be at most `separation`
/// from a box.
template <typename S, typename Use>
void withShapes(const Body<S>& body, const WorldBox& other, double separation, const Use& use) {
  MovingParts found;
  const fcl::Transform3d start_tf = body.start_tf.template cast<double>(),
                         end_tf = body.tf.template cast<double>();
  const auto boxOf = [&](const CellBall& ball) -> WorldBox {
    const fcl::Vector3d a = start_tf * ball.middle, b = end_tf * ball.middle;
    const double margin = ball.radius + 1e-12 * (a.norm() + b.norm());
    return {a.cwiseMin(b).array() - margin, a.cwiseMax(b).array() + margin};
  };
  const auto bound = [&](const CellBall& ball) {
    return gapOf(boxOf(ball), other) <= separation ? 0. : kNone;
  };
  const bool is_octree = body.geometry->getNodeType() == fcl::GEOM_OCTREE;
  const ConvexParts parts(*body.geometry, fcl::Transform3d::Identity());
  parts.visit(
      bound, [] { return 0.; },
      [&](const ConvexPart& part) {
        const auto& [solid, tf] = part.placed;
        if (!is_octree) {
          found.add(MovingPart(solid, start_tf, end_tf), sweptBoxOf(body), SceneImpact::kNoFeature);
          use(found);
          return false;
        }
        const fcl::Vector3d half = solid.support(fcl::Vector3d::Ones());
        found.add(MovingPart(BoxSolid(half), start_tf * tf, end_tf * tf),
                  boxOf({tf.translation(), 1.01 * half.norm()}), static_cast<unsigned>(part.id));
        return false;
      });
  if (is_octree) use(found);
}

/// The first contact of parts of two bodies.
template <typename S>
Impact firstContact(const MovingParts& first, const MovingParts& second, double separation) {
  Impact best;
  const auto test = [&](std::size_t i, std::size_t j) {
    const double latest = std::min(best.time, 1.);
    const double time =
        timeOfContact(first.parts[i], second.parts[j], separation, latest, kParallelIn<S>);
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

/// The first contact of two bodies of which the second is no mesh.
template <typename S>
Impact convexImpact(const Body<S>& a, const WorldBox& box_a, const Body<S>& b,
                    const WorldBox& box_b, double separation) {
  Impact best;
  const auto with = [&](const Body<S>& body, const WorldBox& other, const auto& use) {
    body.mesh ? withTriangles(body, other, separation, use)
              : withShapes(body, other, separation, use);
  };
  with(a, box_b, [&](const MovingParts& first) {
    with(b, box_a,
         [&](const MovingParts& second) { best = firstContact<S>(first, second, separation); });
  });
  return best;
}

/// What a query of the step keeps from call to call.
struct SweptBodies {
  std::vector<WorldBox> all_boxes;           ///< by place
  std::vector<unsigned> bounded, unbounded;  ///< places of bodies
  std::vector<WorldBox> boxes;               ///< of the bounded ones
  BodyTree tree;
  std::vector<BodyPair> pairs;
  std::vector<Impact> impacts;
};

}  // namespace

template <typename S>
SceneImpact Scene<S>::earliestImpact(double separation) const {
  const State& state = *state_;
  requireSeparation(separation);
  state.requireCurrent();
  const Leased<SweptBodies> memory;
  SweptBodies& swept = *memory;
  swept.all_boxes.clear();
  swept.bounded.clear();
  swept.unbounded.clear();
  swept.boxes.clear();
  swept.pairs.clear();
  for (unsigned i = 0; i < state.bodies.size(); ++i) {
    const Body<S>& body = state.bodies[i];
    if (body.options.self_collision) swept.pairs.push_back({i, i});
    const WorldBox box = sweptBoxOf(body);
    swept.all_boxes.push_back(box);
    (box.isBounded() ? swept.bounded : swept.unbounded).push_back(i);
    if (box.isBounded()) swept.boxes.push_back(box);
  }
  const auto add = [&](unsigned a, unsigned b) {
    if (state.admits(state.bodies[a], state.bodies[b]))
      swept.pairs.push_back({std::min(a, b), std::max(a, b)});
  };
  if (!swept.boxes.empty()) {
    swept.tree.update(swept.boxes);
    swept.tree.forEachPair(State::slack(separation), [&](unsigned i, unsigned j) {
      add(swept.bounded[i], swept.bounded[j]);
    });
  }
  for (const unsigned a : swept.unbounded) {
    for (const unsigned b : swept.bounded) add(a, b);
    for (const unsigned b : swept.unbounded)
      if (b < a) add(a, b);
  }
  std::sort(swept.pairs.begin(), swept.pairs.end());
  swept.impacts.assign(swept.pairs.size(), Impact());
  const TaskPool pool(swept.pairs.size() > 1 ? state.threads : 1);
  pool.forEach(static_cast<int>(swept.pairs.size()), [&](int task, int) {
    const BodyPair pair = swept.pairs[static_cast<std::size_t>(task)];
    const Body<S>&a = state.bodies[pair.first], &b = state.bodies[pair.second];
    Impact& impact = swept.impacts[static_cast<std::size_t>(task)];
    if (&a == &b)
      impact = adaptive_bvh::earliestImpact(motionOf(a), separation);
    else if (a.mesh && b.mesh)
      impact = adaptive_bvh::earliestImpact(motionOf(a), motionOf(b), separation);
    else
      impact =
          convexImpact(a, swept.all_boxes[pair.first], b, swept.all_boxes[pair.second], separation);
  });
  SceneImpact best;
  for (std::size_t i = 0; i < swept.pairs.size(); ++i) {
    if (!(swept.impacts[i].time < best.impact.time)) continue;
    best.impact = swept.impacts[i];
    best.bodies = {state.bodies[swept.pairs[i].first].id, state.bodies[swept.pairs[i].second].id};
  }
  return best;
}

template SceneImpact Scene<float>::earliestImpact(double) const;
template SceneImpact Scene<double>::earliestImpact(double) const;
template double Scene<float>::largestSafeStep(double) const;
template double Scene<double>::largestSafeStep(double) const;

}  // namespace adaptive_bvh
