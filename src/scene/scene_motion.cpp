#include "base/leased.h"
#include "base/task_pool.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

template <typename S>
Motion<S> motionOf(const Body<S>& body) {
  const auto& end = body.mesh->vertices();
  const auto& start = body.mesh->previousVertices().empty() ? end : body.mesh->previousVertices();
  return Motion<S>(*body.mesh, start, end, body.start_tf, body.tf);
}

/// Around a mesh where the step begins and where it ends. Vertices move on straight lines.
template <typename S>
WorldBox sweptBoxOf(const Body<S>& body) {
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

/// What a query of the step keeps from call to call.
struct SweptBodies {
  std::vector<unsigned> meshes;  ///< places of bodies
  std::vector<WorldBox> boxes;
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
  swept.meshes.clear();
  swept.boxes.clear();
  swept.pairs.clear();
  for (unsigned i = 0; i < state.bodies.size(); ++i) {
    const Body<S>& body = state.bodies[i];
    if (!body.mesh) continue;
    swept.meshes.push_back(i);
    swept.boxes.push_back(sweptBoxOf(body));
    if (body.options.self_collision) swept.pairs.push_back({i, i});
  }
  if (swept.meshes.empty()) return {};
  swept.tree.update(swept.boxes);
  swept.tree.forEachPair(State::slack(separation), [&](unsigned i, unsigned j) {
    const unsigned a = swept.meshes[i], b = swept.meshes[j];
    if (state.admits(state.bodies[a], state.bodies[b])) swept.pairs.push_back({a, b});
  });
  std::sort(swept.pairs.begin(), swept.pairs.end());
  swept.impacts.assign(swept.pairs.size(), Impact());
  const TaskPool pool(swept.pairs.size() > 1 ? state.threads : 1);
  pool.forEach(static_cast<int>(swept.pairs.size()), [&](int task, int) {
    const BodyPair pair = swept.pairs[static_cast<std::size_t>(task)];
    const Motion<S> first = motionOf(state.bodies[pair.first]);
    swept.impacts[static_cast<std::size_t>(task)] =
        pair.first == pair.second
            ? adaptive_bvh::earliestImpact(first, separation)
            : adaptive_bvh::earliestImpact(first, motionOf(state.bodies[pair.second]), separation);
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

}  // namespace adaptive_bvh
