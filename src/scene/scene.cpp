#include "adaptive_bvh/scene.h"

#include <map>

#include "base/task_pool.h"
#include "query/closed_surface.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {

template <typename S>
Scene<S>::Scene() : state_(std::make_unique<State>()) {}
template <typename S>
Scene<S>::~Scene() = default;
template <typename S>
Scene<S>::Scene(Scene&&) noexcept = default;
template <typename S>
Scene<S>& Scene<S>::operator=(Scene&&) noexcept = default;

namespace {

template <typename S>
void requireOptions(const DeformableMesh<S>* mesh, const BodyOptions& options) {
  if (options.self_collision && !mesh)
    throw std::invalid_argument("adaptive_bvh: only a mesh can collide with itself");
  if (!options.solid) return;
  if (!mesh)
    throw std::invalid_argument("adaptive_bvh: only a mesh can be made solid; a shape always is");
  requireClosed(stateOf(*mesh), "a solid body");
}

}  // namespace

template <typename S>
BodyId Scene<S>::add(std::shared_ptr<const Geometry> geometry, const Transform& tf,
                     const BodyOptions& options) {
  if (!geometry) throw std::invalid_argument("adaptive_bvh: a body has no geometry");
  const Geometry& referenced = *geometry;
  const BodyId id = add(referenced, tf, options);
  state_->bodies.back().owned = std::move(geometry);
  return id;
}

template <typename S>
BodyId Scene<S>::add(const Geometry& geometry, const Transform& tf, const BodyOptions& options) {
  requireBodyGeometry(geometry);
  requireRigid(tf);
  const auto* mesh = dynamic_cast<const DeformableMesh<S>*>(&geometry);
  requireOptions(mesh, options);
  Body<S> body;
  body.id = state_->next_id;
  body.geometry = &geometry;
  body.mesh = mesh;
  body.tf = body.start_tf = tf;
  body.options = options;
  state_->bodies.push_back(std::move(body));
  state_->is_current = false;
  return state_->next_id++;
}

template <typename S>
void Scene<S>::remove(BodyId body) {
  State& state = *state_;
  state.bodies.erase(state.bodies.begin() + std::ptrdiff_t(state.placeOf(body)));
  const auto names = [&](const BodyPair& pair) {
    return pair.first == body || pair.second == body;
  };
  state.ignored.erase(std::remove_if(state.ignored.begin(), state.ignored.end(), names),
                      state.ignored.end());
  state.is_current = false;
}

template <typename S>
void Scene<S>::setTransform(BodyId body, const Transform& tf) {
  Body<S>& at = state_->bodies[state_->placeOf(body)];
  requireRigid(tf);
  at.tf = tf;
  at.is_placed = false;
  state_->is_current = false;
}

template <typename S>
void Scene<S>::setOptions(BodyId body, const BodyOptions& options) {
  Body<S>& at = state_->bodies[state_->placeOf(body)];
  requireOptions(at.mesh, options);
  at.options = options;
}

template <typename S>
Scene<S> Scene<S>::snapshot() const {
  state_->requireCurrent();
  Scene copy;
  *copy.state_ = *state_;
  std::map<const DeformableMesh<S>*, std::shared_ptr<const DeformableMesh<S>>> copies;
  for (Body<S>& body : copy.state_->bodies) {
    if (!body.mesh) continue;
    std::shared_ptr<const DeformableMesh<S>>& mesh = copies[body.mesh];
    if (!mesh) mesh = std::make_shared<DeformableMesh<S>>(*body.mesh);
    body.mesh = mesh.get();
    body.geometry = mesh.get();
    body.owned = mesh;
  }
  return copy;
}

template <typename S>
bool Scene<S>::contains(BodyId body) const {
  return state_->contains(body);
}
template <typename S>
std::size_t Scene<S>::size() const {
  return state_->bodies.size();
}
template <typename S>
std::vector<BodyId> Scene<S>::bodies() const {
  std::vector<BodyId> ids;
  for (const Body<S>& body : state_->bodies) ids.push_back(body.id);
  return ids;
}
template <typename S>
const fcl::CollisionGeometry<S>& Scene<S>::geometry(BodyId body) const {
  return *state_->bodies[state_->placeOf(body)].geometry;
}
template <typename S>
const fcl::Transform3<S>& Scene<S>::transform(BodyId body) const {
  return state_->bodies[state_->placeOf(body)].tf;
}
template <typename S>
const BodyOptions& Scene<S>::options(BodyId body) const {
  return state_->bodies[state_->placeOf(body)].options;
}

template <typename S>
void Scene<S>::ignore(BodyId first, BodyId second) {
  State& state = *state_;
  state.placeOf(first);
  state.placeOf(second);
  const BodyPair pair = State::sorted(first, second);
  const auto at = std::lower_bound(state.ignored.begin(), state.ignored.end(), pair);
  if (at == state.ignored.end() || *at != pair) state.ignored.insert(at, pair);
}
template <typename S>
void Scene<S>::unignore(BodyId first, BodyId second) {
  State& state = *state_;
  state.placeOf(first);
  state.placeOf(second);
  const BodyPair pair = State::sorted(first, second);
  const auto at = std::lower_bound(state.ignored.begin(), state.ignored.end(), pair);
  if (at != state.ignored.end() && *at == pair) state.ignored.erase(at);
}
template <typename S>
void Scene<S>::ignoreNeighbours(const std::vector<BodyId>& chain) {
  for (const BodyId body : chain) state_->placeOf(body);
  state_->ignored.reserve(state_->ignored.size() + chain.size());  // so all of it or nothing
  for (std::size_t i = 1; i < chain.size(); ++i) ignore(chain[i - 1], chain[i]);
}
template <typename S>
void Scene<S>::setFilter(const Filter& filter) {
  state_->filter = filter;
}

template <typename S>
void Scene<S>::setThreads(int threads) {
  if (threads < 1) throw std::invalid_argument("adaptive_bvh: a scene needs one thread or more");
  state_->threads = threads;
}

template <typename S>
void Scene<S>::beginStep() {
  for (Body<S>& body : state_->bodies) body.start_tf = body.tf;
}

/// With fewer bodies, handing tasks to threads costs more than it gains.
constexpr std::size_t kParallelBodies = 64;

template <typename S>
void Scene<S>::update() {
  State& state = *state_;
  const TaskPool pool(state.bodies.size() >= kParallelBodies ? state.threads : 1);
  state.is_current = false;  // until all of it is done: what follows may throw std::bad_alloc
  state.in_tree.clear();
  state.unbounded.clear();
  state.boxes.clear();
  pool.forEachPart(static_cast<int>(state.bodies.size()), pool.parts(), [&](int i, int end, int) {
    for (; i < end; ++i) bound(state.bodies[static_cast<std::size_t>(i)]);
  });
  for (unsigned i = 0; i < state.bodies.size(); ++i) {
    const Body<S>& body = state.bodies[i];
    if (!body.box.isBounded()) {
      state.unbounded.push_back(i);
      continue;
    }
    state.in_tree.push_back(i);
    state.boxes.push_back(body.box);
  }
  if (state.boxes.empty())
    state.tree.clear();
  else
    state.tree.update(state.boxes);
  state.is_current = true;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                     \
  template Scene<S>::Scene();                                                           \
  template Scene<S>::~Scene();                                                          \
  template Scene<S>::Scene(Scene&&) noexcept;                                           \
  template Scene<S>& Scene<S>::operator=(Scene&&) noexcept;                             \
  template BodyId Scene<S>::add(std::shared_ptr<const Geometry>, const Transform&,      \
                                const BodyOptions&);                                    \
  template BodyId Scene<S>::add(const Geometry&, const Transform&, const BodyOptions&); \
  template void Scene<S>::remove(BodyId);                                               \
  template void Scene<S>::setTransform(BodyId, const Transform&);                       \
  template void Scene<S>::setOptions(BodyId, const BodyOptions&);                       \
  template Scene<S> Scene<S>::snapshot() const;                                         \
  template bool Scene<S>::contains(BodyId) const;                                       \
  template std::size_t Scene<S>::size() const;                                          \
  template std::vector<BodyId> Scene<S>::bodies() const;                                \
  template const fcl::CollisionGeometry<S>& Scene<S>::geometry(BodyId) const;           \
  template const fcl::Transform3<S>& Scene<S>::transform(BodyId) const;                 \
  template const BodyOptions& Scene<S>::options(BodyId) const;                          \
  template void Scene<S>::ignore(BodyId, BodyId);                                       \
  template void Scene<S>::unignore(BodyId, BodyId);                                     \
  template void Scene<S>::ignoreNeighbours(const std::vector<BodyId>&);                 \
  template void Scene<S>::setFilter(const Filter&);                                     \
  template void Scene<S>::setThreads(int);                                              \
  template void Scene<S>::beginStep();                                                  \
  template void Scene<S>::update();
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
