// The class Scene: checks arguments, calls SceneState in double precision, and rounds the results.
#include "adaptive_bvh/scene.h"

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "base/leased.h"
#include "base/rigid.h"
#include "query/closed_surface.h"
#include "query/points/ray_search.h"
#include "query/single_precision.h"
#include "scene/scene_results.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {

/// A scene in double precision, and the caller's geometries and transforms.
template <typename S>
struct Scene<S>::State {
  /// What the caller passed for a body.
  struct Given {
    std::shared_ptr<const Geometry> owned;  ///< null if the scene only refers to the geometry
    const Geometry* geometry;
    Transform tf;
  };

  SceneState scene{std::is_same<S, float>::value};
  std::vector<Given> given;  ///< by index in SceneState::bodies
};

namespace {

/// Throws std::invalid_argument if a geometry does not allow the options.
void requireOptions(const BodyGeometry& geometry, const BodyOptions& options) {
  if (options.self_collision && !geometry.isMesh())
    throw std::invalid_argument("adaptive_bvh: only a mesh can collide with itself");
  if (!options.solid) return;
  if (!geometry.isMesh())
    throw std::invalid_argument("adaptive_bvh: only a mesh can be made solid; a shape always is");
  requireClosed(geometry.mesh(), "a solid body");
}

/// Points in double precision: the array itself, or a copy in `converted`.
const fcl::Vector3d* inDouble(const fcl::Vector3d* points, std::size_t,
                              std::vector<fcl::Vector3d>&) {
  return points;
}
const fcl::Vector3d* inDouble(const fcl::Vector3f* points, std::size_t count,
                              std::vector<fcl::Vector3d>& converted) {
  converted.resize(count);
  for (std::size_t i = 0; i < count; ++i) converted[i] = points[i].cast<double>();
  return converted.data();
}

}  // namespace

template <typename S>
const SceneState& detail::SceneAccess<S>::state(const Scene<S>& scene) {
  return scene.state_->scene;
}

template <typename S>
Scene<S>::Scene() : state_(std::make_unique<State>()) {}
template <typename S>
Scene<S>::~Scene() = default;
template <typename S>
Scene<S>::Scene(Scene&&) noexcept = default;
template <typename S>
Scene<S>& Scene<S>::operator=(Scene&&) noexcept = default;

// ---- Bodies

template <typename S>
BodyId Scene<S>::add(std::shared_ptr<const Geometry> geometry, const Transform& tf,
                     const BodyOptions& options) {
  if (!geometry) throw std::invalid_argument("adaptive_bvh: a body has no geometry");
  const Geometry& referenced = *geometry;
  const BodyId id = add(referenced, tf, options);
  state_->given.back().owned = std::move(geometry);
  return id;
}

template <typename S>
BodyId Scene<S>::add(const Geometry& geometry, const Transform& tf, const BodyOptions& options) {
  const BodyGeometry in_double(geometry);
  requireRigid(tf);
  requireOptions(in_double, options);
  SceneState& scene = state_->scene;
  state_->given.push_back({nullptr, &geometry, tf});
  try {
    scene.bodies.push_back(
        {scene.next_id, in_double, options, fcl::Transform3d(tf.template cast<double>())});
  } catch (...) {
    state_->given.pop_back();
    throw;
  }
  scene.is_current = false;
  scene.setChanged();
  return scene.next_id++;
}

template <typename S>
void Scene<S>::remove(BodyId body) {
  SceneState& scene = state_->scene;
  const auto index = std::ptrdiff_t(scene.indexOf(body));
  scene.bodies.erase(scene.bodies.begin() + index);
  state_->given.erase(state_->given.begin() + index);
  scene.forget(body);
  scene.is_current = false;
  scene.setChanged();
}

template <typename S>
void Scene<S>::setTransform(BodyId body, const Transform& tf) {
  const std::size_t index = state_->scene.indexOf(body);
  requireRigid(tf);
  state_->given[index].tf = tf;
  Body& changed = state_->scene.bodies[index];
  changed.tf = tf.template cast<double>();
  changed.has_current_bounds = false;
  state_->scene.is_current = false;
  state_->scene.setChanged();
}

template <typename S>
void Scene<S>::setOptions(BodyId body, const BodyOptions& options) {
  Body& changed = state_->scene.bodies[state_->scene.indexOf(body)];
  requireOptions(changed.geometry, options);
  changed.options = options;
  state_->scene.setChanged();
}

template <typename S>
Scene<S> Scene<S>::snapshot() const {
  state_->scene.requireCurrent();
  Scene copy;
  *copy.state_ = *state_;
  std::map<const Geometry*, std::shared_ptr<const Geometry>> copies;
  for (std::size_t i = 0; i < size(); ++i) {
    Body& body = copy.state_->scene.bodies[i];
    if (!body.isMesh()) continue;
    auto& [owned, geometry, tf] = copy.state_->given[i];
    std::shared_ptr<const Geometry>& mesh = copies[geometry];
    if (!mesh)
      mesh = std::make_shared<DeformableMesh<S>>(static_cast<const DeformableMesh<S>&>(*geometry));
    owned = mesh;
    geometry = mesh.get();
    body.geometry = BodyGeometry(*mesh);
  }
  return copy;
}

template <typename S>
bool Scene<S>::contains(BodyId body) const {
  return state_->scene.contains(body);
}
template <typename S>
std::size_t Scene<S>::size() const {
  return state_->scene.bodies.size();
}
template <typename S>
std::vector<BodyId> Scene<S>::bodies() const {
  std::vector<BodyId> ids;
  for (const Body& body : state_->scene.bodies) ids.push_back(body.id);
  return ids;
}
template <typename S>
const fcl::CollisionGeometry<S>& Scene<S>::geometry(BodyId body) const {
  return *state_->given[state_->scene.indexOf(body)].geometry;
}
template <typename S>
const fcl::Transform3<S>& Scene<S>::transform(BodyId body) const {
  return state_->given[state_->scene.indexOf(body)].tf;
}
template <typename S>
const BodyOptions& Scene<S>::options(BodyId body) const {
  return state_->scene.bodies[state_->scene.indexOf(body)].options;
}

// ---- Which pairs count

template <typename S>
void Scene<S>::ignore(BodyId first, BodyId second) {
  state_->scene.ignore(first, second);
}
template <typename S>
void Scene<S>::unignore(BodyId first, BodyId second) {
  state_->scene.unignore(first, second);
}
template <typename S>
void Scene<S>::ignoreNeighbours(const std::vector<BodyId>& chain) {
  state_->scene.ignoreNeighbours(chain);
}
template <typename S>
void Scene<S>::setFilter(const Filter& filter) {
  state_->scene.filter = filter;
  state_->scene.setChanged();
}

// ---- Steps

template <typename S>
void Scene<S>::beginStep() {
  for (Body& body : state_->scene.bodies) body.start_tf = body.tf;
}
template <typename S>
void Scene<S>::setThreads(int threads) {
  if (threads < 1) throw std::invalid_argument("adaptive_bvh: a scene needs one thread or more");
  state_->scene.threads = threads;
}
template <typename S>
void Scene<S>::update() {
  state_->scene.update();
}

// ---- Queries

template <typename S>
std::size_t Scene<S>::collisions(const SceneCollisionRequest& request,
                                 SceneCollisions<S>& result) const {
  answerInDouble(result,
                 [&](SceneCollisions<double>& found) { state_->scene.collisions(request, found); });
  for (std::size_t i = 0; i < result.pairs.size(); ++i) {
    const Geometry &first = geometry(result.pairs[i].first),
                   &second = geometry(result.pairs[i].second);
    for (std::size_t k = result.offsets[i]; k < result.offsets[i + 1]; ++k) {
      result.contacts[k].o1 = &first;
      result.contacts[k].o2 = &second;
    }
  }
  return result.pairs.size();
}

template <typename S>
std::size_t Scene<S>::pairsWithin(const ProximityRequest<S>& request,
                                  SceneTrianglePairs<S>& result) const {
  requireDistance(request.distance);
  answerInDouble(result, [&](SceneTrianglePairs<double>& found) {
    state_->scene.pairsWithin(inDouble(request), found);
  });
  return result.found.size();
}

template <typename S>
std::size_t Scene<S>::featurePairsWithin(S distance, SceneFeaturePairs& result) const {
  requireDistance(distance);
  state_->scene.featurePairsWithin(static_cast<double>(distance), result);
  return result.found.size();
}

template <typename S>
std::size_t Scene<S>::vertexContacts(S margin, SceneVertexContacts<S>& result) const {
  requireDistance(margin, "margin");
  answerInDouble(result, [&](SceneVertexContacts<double>& found) {
    state_->scene.vertexContacts(static_cast<double>(margin), found);
  });
  return result.found.size();
}

template <typename S>
bool Scene<S>::isNearer(S distance) const {
  requireDistance(distance);
  return state_->scene.isNearer(static_cast<double>(distance));
}

template <typename S>
SceneDistance<S> Scene<S>::distance() {
  SceneDistance<S> result;
  answerInDouble(result, [&](SceneDistance<double>& found) {
    found = state_->scene.distance();
    state_->scene.keepDistance(found);
  });
  return result;
}

template <typename S>
SceneDistance<S> Scene<S>::distance() const {
  SceneDistance<S> result;
  answerInDouble(result, [&](SceneDistance<double>& found) { found = state_->scene.distance(); });
  return result;
}

template <typename S>
SceneDistance<S> Scene<S>::nearest(BodyId body) {
  SceneDistance<S> result;
  answerInDouble(result, [&](SceneDistance<double>& found) {
    found = state_->scene.nearest(body);
    state_->scene.keepNearest(body, found);
  });
  return result;
}

template <typename S>
SceneDistance<S> Scene<S>::nearest(BodyId body) const {
  SceneDistance<S> result;
  answerInDouble(result,
                 [&](SceneDistance<double>& found) { found = state_->scene.nearest(body); });
  return result;
}

template <typename S>
void Scene<S>::nearest(BodyId body, std::size_t k, std::vector<SceneDistance<S>>& result) const {
  answerInDouble(result, [&](std::vector<SceneDistance<double>>& found) {
    state_->scene.nearest(body, k, found);
  });
  std::sort(result.begin(), result.end(), isNearerBody<S>);  // rounding may make distances equal
}

template <typename S>
ScenePoint<S> Scene<S>::nearestPoint(const fcl::Vector3<S>& point) const {
  state_->scene.requireCurrent();
  if (!point.allFinite()) throw std::invalid_argument("adaptive_bvh: a point is not finite");
  ScenePoint<S> result;
  answerInDouble(result, [&](ScenePoint<double>& found) {
    found = state_->scene.nearestPoint(point.template cast<double>());
  });
  return result;
}

template <typename S>
void Scene<S>::firstHits(const fcl::Vector3<S>* origins, const fcl::Vector3<S>* directions,
                         std::size_t count, const RayRange<S>& range,
                         std::vector<SceneRayHit<S>>& result) const {
  state_->scene.requireCurrent();
  requireRange(range);
  for (std::size_t i = 0; i < count; ++i)
    if (!origins[i].allFinite() || !directions[i].allFinite() || directions[i].isZero(0))
      throw std::invalid_argument("adaptive_bvh: ray " + std::to_string(i) +
                                  " is not finite or has no direction");
  const RayRange<double> in_double = {static_cast<double>(range.begin),
                                      static_cast<double>(range.end)};
  const Leased<std::array<std::vector<fcl::Vector3d>, 2>> converted;
  answerInDouble(result, [&](std::vector<SceneRayHit<double>>& found) {
    state_->scene.firstHits(inDouble(origins, count, (*converted)[0]),
                            inDouble(directions, count, (*converted)[1]), count, in_double, found);
  });
}

template <typename S>
SceneImpact Scene<S>::earliestImpact(double separation) const {
  return state_->scene.earliestImpact(separation);
}

template <typename S>
SceneClearance Scene<S>::leastDistance(BodyId body, double tolerance, FramePath path) {
  const SceneClearance found = state_->scene.leastDistance(body, tolerance, path);
  state_->scene.keepNearest(body, found);
  return found;
}

template <typename S>
SceneClearance Scene<S>::leastDistance(BodyId body, double tolerance, FramePath path) const {
  return state_->scene.leastDistance(body, tolerance, path);
}

template <typename S>
void Scene<S>::leastDistances(BodyId body, std::size_t k, double tolerance,
                              std::vector<SceneClearance>& result, FramePath path) const {
  state_->scene.leastDistances(body, k, tolerance, path, result);
}

template <typename S>
std::size_t Scene<S>::intervalsBelow(double clearance, double tolerance, SceneIntervals& result,
                                     FramePath path) const {
  state_->scene.intervalsBelow(clearance, tolerance, path, result);
  return result.pairs.size();
}

template class Scene<float>;
template class Scene<double>;
template struct detail::SceneAccess<float>;
template struct detail::SceneAccess<double>;

}  // namespace adaptive_bvh
