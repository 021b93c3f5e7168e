// The class Scene: checks arguments, and calls SceneState.
#include "adaptive_bvh/scene.h"

#include <map>
#include <stdexcept>
#include <string>

#include "base/rigid.h"
#include "query/closed_surface.h"
#include "query/points/ray_search.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {

struct Scene::State : SceneState {};

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

}  // namespace

const SceneState& detail::SceneAccess::state(const Scene& scene) { return *scene.state_; }

Scene::Scene() : state_(std::make_unique<State>()) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

// ---- Bodies

BodyId Scene::add(std::shared_ptr<const Geometry> geometry, const Transform& tf,
                  const BodyOptions& options) {
  if (!geometry) throw std::invalid_argument("adaptive_bvh: a body has no geometry");
  const Geometry& referenced = *geometry;
  const BodyId id = add(referenced, tf, options);
  state_->bodies.back().owned = std::move(geometry);
  return id;
}

BodyId Scene::add(const Geometry& geometry, const Transform& tf, const BodyOptions& options) {
  const BodyGeometry given(geometry);
  requireRigid(tf);
  requireOptions(given, options);
  SceneState& scene = *state_;
  scene.bodies.push_back({scene.next_id, given, options, tf});
  scene.is_current = false;
  scene.setChanged();
  return scene.next_id++;
}

void Scene::remove(BodyId body) {
  SceneState& scene = *state_;
  const auto index = std::ptrdiff_t(scene.indexOf(body));
  scene.bodies.erase(scene.bodies.begin() + index);
  scene.forget(body);
  scene.is_current = false;
  scene.setChanged();
}

void Scene::setTransform(BodyId body, const Transform& tf) {
  Body& changed = state_->bodies[state_->indexOf(body)];
  requireRigid(tf);
  changed.tf = tf;
  changed.has_current_bounds = false;
  state_->is_current = false;
  state_->setChanged();
}

void Scene::setOptions(BodyId body, const BodyOptions& options) {
  Body& changed = state_->bodies[state_->indexOf(body)];
  requireOptions(changed.geometry, options);
  changed.options = options;
  state_->setChanged();
}

Scene Scene::snapshot() const {
  state_->requireCurrent();
  Scene copy;
  *copy.state_ = *state_;
  std::map<const Geometry*, std::shared_ptr<const Geometry>> copies;
  for (Body& body : copy.state_->bodies) {
    if (!body.isMesh()) continue;
    const Geometry& geometry = body.geometry.given();
    std::shared_ptr<const Geometry>& mesh = copies[&geometry];
    if (!mesh)
      mesh = std::make_shared<DeformableMesh>(static_cast<const DeformableMesh&>(geometry));
    body.owned = mesh;
    body.geometry = BodyGeometry(*mesh);
  }
  return copy;
}

bool Scene::contains(BodyId body) const { return state_->contains(body); }
std::size_t Scene::size() const { return state_->bodies.size(); }
std::vector<BodyId> Scene::bodies() const {
  std::vector<BodyId> ids;
  for (const Body& body : state_->bodies) ids.push_back(body.id);
  return ids;
}

const fcl::CollisionGeometryd& Scene::geometry(BodyId body) const {
  return state_->bodies[state_->indexOf(body)].geometry.given();
}

const fcl::Transform3d& Scene::transform(BodyId body) const {
  return state_->bodies[state_->indexOf(body)].tf;
}

const BodyOptions& Scene::options(BodyId body) const {
  return state_->bodies[state_->indexOf(body)].options;
}

// ---- Which pairs count

void Scene::ignore(BodyId first, BodyId second) { state_->ignore(first, second); }
void Scene::unignore(BodyId first, BodyId second) { state_->unignore(first, second); }
void Scene::ignoreNeighbours(const std::vector<BodyId>& chain) { state_->ignoreNeighbours(chain); }
void Scene::setFilter(const Filter& filter) {
  state_->filter = filter;
  state_->setChanged();
}

// ---- Steps

void Scene::beginStep() {
  for (Body& body : state_->bodies) body.start_tf = body.tf;
}
void Scene::setThreads(int threads) {
  if (threads < 1) throw std::invalid_argument("adaptive_bvh: a scene needs one thread or more");
  state_->threads = threads;
}
void Scene::update() { state_->update(); }

// ---- Queries

std::size_t Scene::collide(const SceneCollisionRequest& request, SceneCollisions& result) const {
  state_->collide(request, result);
  return result.pairs.size();
}

std::size_t Scene::pairsWithin(const ProximityRequest& request, SceneTrianglePairs& result) const {
  requireDistance(request.distance);
  state_->pairsWithin(request, result);
  return result.found.size();
}

std::size_t Scene::featurePairsWithin(double distance, SceneFeaturePairs& result) const {
  requireDistance(distance);
  state_->featurePairsWithin(distance, result);
  return result.found.size();
}

std::size_t Scene::vertexContacts(double distance, SceneVertexContacts& result) const {
  requireDistance(distance);
  state_->vertexContacts(distance, result);
  return result.found.size();
}

bool Scene::isNearer(double distance) const {
  requireDistance(distance);
  return state_->isNearer(distance);
}

SceneDistance Scene::distance() {
  const SceneDistance found = state_->distance();
  state_->keepDistance(found);
  return found;
}

SceneDistance Scene::distance() const { return state_->distance(); }

SceneDistance Scene::nearest(BodyId body) {
  const SceneDistance found = state_->nearest(body);
  state_->keepNearest(body, found);
  return found;
}

SceneDistance Scene::nearest(BodyId body) const { return state_->nearest(body); }

void Scene::nearest(BodyId body, std::size_t k, std::vector<SceneDistance>& result) const {
  state_->nearest(body, k, result);
}

ScenePoint Scene::nearestPoint(const fcl::Vector3d& point) const {
  state_->requireCurrent();
  if (!point.allFinite()) throw std::invalid_argument("adaptive_bvh: a point is not finite");
  return state_->nearestPoint(point);
}

void Scene::firstHits(const fcl::Vector3d* origins, const fcl::Vector3d* directions,
                      std::size_t count, const RayRange& range,
                      std::vector<SceneRayHit>& result) const {
  state_->requireCurrent();
  requireRange(range);
  for (std::size_t i = 0; i < count; ++i)
    if (!origins[i].allFinite() || !directions[i].allFinite() || directions[i].isZero(0))
      throw std::invalid_argument("adaptive_bvh: ray " + std::to_string(i) +
                                  " is not finite or has no direction");
  state_->firstHits(origins, directions, count, range, result);
}

SceneImpact Scene::earliestImpact(double distance) const {
  return state_->earliestImpact(distance);
}

SceneClearance Scene::leastDistance(BodyId body, double tolerance, FramePath path) {
  const SceneClearance found = state_->leastDistance(body, tolerance, path);
  state_->keepNearest(body, found);
  return found;
}

SceneClearance Scene::leastDistance(BodyId body, double tolerance, FramePath path) const {
  return state_->leastDistance(body, tolerance, path);
}

void Scene::leastDistances(BodyId body, std::size_t k, double tolerance, FramePath path,
                           std::vector<SceneClearance>& result) const {
  state_->leastDistances(body, k, tolerance, path, result);
}

std::size_t Scene::intervalsBelow(double distance, double tolerance, FramePath path,
                                  SceneIntervals& result) const {
  state_->intervalsBelow(distance, tolerance, path, result);
  return result.pairs.size();
}

}  // namespace adaptive_bvh
