// The first impact of a scene's bodies in a step: searches the pairs whose swept boxes overlap.
#include <algorithm>
#include <optional>

#include "base/leased.h"
#include "base/rigid.h"
#include "base/task_pool.h"
#include "ccd/placed_motion.h"
#include "scene/scene_state.h"
#include "scene/stepping_body.h"

namespace adaptive_bvh {
namespace {

/// The first impact of two bodies, at least one of which is not a mesh.
Impact convexImpact(const Body& a, const Body& b, double separation) {
  SteppingBody first(a, FramePath::Straight), second(b, FramePath::Straight);
  MotionClearance found;
  lowerToImpact(first, second, separation, found);
  static_assert(unsigned(-1) == SceneImpact::kNoFeature, "of a shape");
  if (!found.meet()) return {};
  return {found.time, {}, {unsigned(found.elements[0]), unsigned(found.elements[1])}};
}

/// Memory of earliestImpact, reused from call to call.
class ImpactMemory {
 public:
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
  const std::vector<BodyPair>& pairs = memory.pairs;
  findSweptPairs(FramePath::Straight, separation, memory.pairs);
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
            : convexImpact(bodies[a], bodies[b], separation);
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
