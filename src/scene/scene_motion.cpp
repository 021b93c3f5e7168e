// The first impact of a scene's bodies in a step: searches the pairs whose swept boxes overlap.
#include <algorithm>
#include <array>
#include <deque>
#include <limits>
#include <optional>

#include "base/leased.h"
#include "base/rigid.h"
#include "base/task_pool.h"
#include "ccd/clearance_search.h"
#include "ccd/moving_pairs.h"
#include "ccd/placed_motion.h"
#include "scene/scene_state.h"
#include "scene/stepping_body.h"

namespace adaptive_bvh {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

/// A body in its step.
struct SweptBody {
  const Body& body;
  const WorldBox& box;  ///< around the motion
};

/// A mesh, a shape or a cell of an octree that moves.
struct SweptPart {
  BoxedBody boxed;
  WorldBox box;     ///< around the motion
  unsigned number;  ///< of a cell; SceneImpact::kNoFeature for a mesh or a shape
};

/// A mesh or a shape, or the cells of an octree that may come within `separation` of a box.
class SweptParts {
 public:
  /// `memory` is that of all cells, so each of them may meet one mesh only.
  SweptParts(const SweptBody& swept, const WorldBox& other, double separation,
             MovingBoxes& memory) {
    const Body& body = swept.body;
    if (!body.isOctree()) {
      whole_.emplace(body, FramePath::Straight);
      all.push_back({{whole_->moving(), memory}, swept.box, SceneImpact::kNoFeature});
      return;
    }
    const fcl::Transform3d from = rotated(body.start_tf), to = rotated(body.tf);
    const auto boxOf = [&](const CellBall& ball) -> WorldBox {
      const fcl::Vector3d a = from * ball.middle, b = to * ball.middle;
      const double margin = ball.radius + 1e-12 * (a.norm() + b.norm());
      return {a.cwiseMin(b).array() - margin, a.cwiseMax(b).array() + margin};
    };
    const auto bound = [&](const CellBall& ball) {
      return gapOf(boxOf(ball), other) <= separation ? 0. : kNone;
    };
    const QueryObject object(body.geometry.at(fcl::Transform3d::Identity()));
    object.parts().visit(
        bound, [] { return 0.; },
        [&](const ConvexPart& part) {
          const auto& [solid, tf] = part.placed;
          solids_.push_back(static_cast<const BoxSolid&>(solid));
          cells_.emplace_back(solids_.back(), FrameMotion(from * tf, to * tf, FramePath::Straight));
          const WorldBox box = boxOf({tf.translation(), cells_.back().radius()});
          all.push_back({{cells_.back(), memory}, box, static_cast<unsigned>(part.id)});
          return false;
        });
  }

  std::vector<SweptPart> all;

 private:
  std::optional<SteppingBody> whole_;
  std::deque<BoxSolid> solids_;
  std::deque<MovingBody> cells_;
};

/// The time at which two planes or half-spaces touch: 0 if one turns, because only parallel ones
/// are apart.
double timeOfFlatImpact(const MovingBody& first, const MovingBody& second, double separation) {
  const auto atStart = [](const MovingBody& body) -> PlacedSolid {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = body.at(0).frame.linear;
    tf.translation() = body.at(0).frame.translation;
    return {*body.solid(), tf};
  };
  const TriangleGap start = gapOf(atStart(first), atStart(second));
  if (!(start.distance > separation)) return 0;
  const fcl::Vector3d n = (start.points.second - start.points.first) / start.distance;
  double at_end = 0;  // the gap, negative if they overlap
  for (const MovingBody* body : {&first, &second}) {
    const PlaneAt from(*body, 0), to(*body, 1);
    if (from.normal.cross(to.normal).norm() > kParallel) return 0;
    at_end += (body == &first ? -1 : 1) * n.dot(to.normal) * to.offset;
  }
  if (at_end > separation) return kNone;
  constexpr double kEarly = 1 - 1e-12;
  return (start.distance - separation) / (start.distance - at_end) * kEarly;
}

/// Lowers `best` to the first impact of two parts. Of impacts at the same time, the smallest
/// numbers count.
void lowerTo(SweptPart& first, SweptPart& second, double separation, Impact& best) {
  const bool swaps = orderOf(first.boxed.body) > orderOf(second.boxed.body);
  SweptPart &a = swaps ? second : first, &b = swaps ? first : second;
  MotionClearance found;
  if (a.boxed.body.flat())
    found.time = timeOfFlatImpact(a.boxed.body, b.boxed.body, separation);
  else if (!findFirstImpact({a.boxed, b.boxed, kNone}, separation, std::min(best.time, 1.), found))
    return;
  if (swaps) swapBodies(found);
  const auto numberOf = [](int triangle, const SweptPart& part) {
    return triangle < 0 ? part.number : static_cast<unsigned>(triangle);
  };
  const FeaturePair pair{numberOf(found.triangles[0], first), numberOf(found.triangles[1], second)};
  if (found.time < best.time || (found.time == best.time && pair < best.pair))
    best = {found.time, {}, pair};
}

/// The first impact of two bodies, at least one of which is not a mesh. Of two octrees, a tree of
/// boxes finds the pairs of cells.
Impact convexImpact(const SweptBody& a, const SweptBody& b, double separation) {
  Impact best;
  const Leased<std::array<MovingBoxes, 2>> memory;
  SweptParts second(b, a.box, separation, (*memory)[1]);
  if (second.all.empty()) return best;
  std::vector<WorldBox> boxes;
  WorldBox around = second.all.front().box;  // an octree's own box is far larger than its cells
  for (const SweptPart& y : second.all) {
    boxes.push_back(y.box);
    around = aroundBoth(around, y.box);
  }
  SweptParts first(a, around, separation, (*memory)[0]);
  if (first.all.size() <= 1 || second.all.size() <= 1) {
    for (SweptPart& x : first.all)
      for (SweptPart& y : second.all) lowerTo(x, y, separation, best);
    return best;
  }
  BodyTree tree;
  tree.update(boxes);
  for (SweptPart& x : first.all)
    tree.visitByDistance(x.box, [&](unsigned i, double gap) {
      if (gap <= separation) lowerTo(x, second.all[i], separation, best);
      return separation;
    });
  return best;
}

/// Memory of earliestImpact, reused from call to call.
class ImpactMemory {
 public:
  std::vector<WorldBox> boxes;  ///< around the motions, by index of the body
  std::vector<BodyPair> pairs;
  std::vector<Impact> impacts;  ///< by pair

  /// Transforms the vertices of the meshes in pairs of two meshes to the world, once each.
  void place(const std::vector<Body>& bodies, const TaskPool& pool) {
    meshes_.clear();
    for (const auto& [a, b] : pairs)
      if (bodies[a].isMesh() && bodies[b].isMesh()) meshes_.insert(meshes_.end(), {a, b});
    std::sort(meshes_.begin(), meshes_.end());
    meshes_.erase(std::unique(meshes_.begin(), meshes_.end()), meshes_.end());
    motions_.resize(std::max(motions_.size(), bodies.size()));
    pool.forEach(static_cast<int>(meshes_.size()), [&](int task, int) {
      const BodyId i = meshes_[static_cast<std::size_t>(task)];
      const Body& body = bodies[i];
      const MeshState& mesh = body.mesh();
      const auto& start = mesh.previous.empty() ? mesh.vertices : mesh.previous;
      motions_[i].placed.emplace(mesh, start.data(), mesh.vertices.data(), body.start_tf, body.tf,
                                 motions_[i].memory);
    });
  }
  const PlacedMotion& motion(BodyId i) const { return *motions_[i].placed; }

 private:
  struct Motion {
    PlacedMotion::Memory memory;
    std::optional<PlacedMotion> placed;
  };
  std::vector<Motion> motions_;  ///< by index of the body
  std::vector<BodyId> meshes_;
};

}  // namespace

SceneImpact SceneState::earliestImpact(double separation) const {
  requireSeparation(separation);
  requireCurrent();
  const Leased<ImpactMemory> leased;
  ImpactMemory& memory = *leased;
  memory.boxes.clear();
  for (const Body& body : bodies) memory.boxes.push_back(sweptBox(body));
  const std::vector<BodyPair>& pairs = memory.pairs;
  findSweptPairs(memory.boxes, separation, memory.pairs);
  addSelfPairs(memory.pairs);
  memory.impacts.assign(pairs.size(), Impact());
  const TaskPool pool(pairs.size() > 1 ? threads : 1);
  memory.place(bodies, pool);
  pool.forEach(static_cast<int>(pairs.size()), [&](int task, int) {
    const auto i = static_cast<std::size_t>(task);
    const auto [a, b] = pairs[i];
    memory.impacts[i] =
        bodies[a].isMesh() && bodies[b].isMesh()
            ? findEarliestImpact(memory.motion(a).with(memory.motion(b), separation))
            : convexImpact({bodies[a], memory.boxes[a]}, {bodies[b], memory.boxes[b]}, separation);
  });
  SceneImpact best;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!(memory.impacts[i].time < best.impact.time)) continue;
    best.impact = memory.impacts[i];
    best.bodies = {bodies[pairs[i].first].id, bodies[pairs[i].second].id};
  }
  return best;
}

}  // namespace adaptive_bvh
