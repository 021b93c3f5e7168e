#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <utility>
#include <vector>

#include "adaptive_bvh/scene.h"
#include "bound.h"
#include "locked_mesh.h"

namespace adaptive_bvh::python {

/// Python's Scene: a scene of the library, the meshes that it refers to, and a lock. Queries share
/// the lock and those of the meshes, what changes the scene has it for itself. Locks are only held
/// without the GIL.
class LockedScene : public Bound {
 public:
  /// Adds a mesh or a shape. Throws py::type_error on others, and as poseFrom.
  BodyId add(const py::object& body, const py::object& tf, const BodyOptions& options);
  void remove(BodyId body);
  void setTransform(BodyId body, const py::object& tf);
  /// As (4, 4) numbers.
  py::array transform(BodyId body) const;
  /// What `add` was given.
  py::object geometry(BodyId body) const;
  void ignore(BodyId first, BodyId second);
  void unignore(BodyId first, BodyId second);
  void ignoreNeighbours(const std::vector<BodyId>& chain);
  void beginStep();
  void setThreads(int threads);
  /// A function of Python's, or None.
  void setFilter(const py::object& filter);

  /// All that a scene is made of, as pickle takes it. Of meshes those of the scene, or copies: all
  /// of one moment, one for bodies that share a mesh.
  py::tuple state(bool copies_meshes) const;
  /// A scene of what `state` returned, with the same numbers of bodies.
  static std::unique_ptr<LockedScene> fromState(const py::tuple& state);

  /// Without a lock: of a scene that nothing refers to any more.
  void clearFunction();
  int visitFunction(visitproc visit, void* arg) const {
    Py_VISIT(filter_.ptr());
    return 0;
  }

  /// Runs f(scene) alone, without the GIL.
  template <typename F>
  auto change(const F& f) {
    CallbackScope::refuseChange();
    const py::gil_scoped_release nogil;
    const std::unique_lock alone(mutex_);
    return f(scene_);
  }
  /// As above, with the locks of all meshes.
  template <typename F>
  auto changeWithMeshes(const F& f) {
    CallbackScope::refuseChange();
    const py::gil_scoped_release nogil;
    const std::unique_lock alone(mutex_);
    const auto locks = lockMeshes();
    return f(scene_);
  }
  /// As above, beside other queries.
  template <typename F>
  auto query(const F& f) const {
    const py::gil_scoped_release nogil;
    const Locks locks = share({});
    return std::invoke(f, scene_);
  }

  /// The locks that a query holds.
  struct Locks {
    LockedMesh::SharedLock scene;
    std::vector<LockedMesh::SharedLock> meshes;
  };
  /// Holds the locks of a query, and the locks of other meshes. Call it without the GIL.
  Locks share(const std::set<const LockedMesh*>& others) const {
    LockedMesh::SharedLock shared;
    if (!CallbackScope::holds(this)) shared = LockedMesh::SharedLock(mutex_);
    return {std::move(shared), lockMeshes(others)};
  }
  /// Whether a mesh is a body of the scene.
  bool has(const void* mesh) const {
    return std::any_of(meshes_.begin(), meshes_.end(),
                       [&](const auto& body) { return body.second.get() == mesh; });
  }
  /// The C++ scene. Read it while the locks are held.
  const Scene& scene() const { return scene_; }

 private:
  /// Those of the scene and others.
  std::vector<LockedMesh::SharedLock> lockMeshes(std::set<const LockedMesh*> meshes = {}) const;

  Scene scene_;
  std::vector<std::pair<BodyId, std::shared_ptr<const LockedMesh>>> meshes_;
  // What the C++ scene does not return.
  std::map<BodyId, fcl::Transform3d> starts_;  ///< of the step: since begin_step, or add
  std::set<std::pair<BodyId, BodyId>> ignored_;
  BodyId next_ = 0;  ///< number of the next body
  int threads_ = 1;
  std::map<BodyId, py::object> geometries_;  ///< only touched with the GIL
  py::object filter_ = py::none();           ///< likewise; the scene refers to it
  mutable std::shared_mutex mutex_;
};

/// A method that returns what one of the C++ scene's returns, which only reads it.
template <typename Result, typename... Args>
auto reading(Result (Scene::*method)(Args...) const) {
  return [method](const LockedScene& self, const std::decay_t<Args>&... arguments) {
    return self.query(
        [&](const Scene& scene) -> std::decay_t<Result> { return (scene.*method)(arguments...); });
  };
}

/// Pairs of bodies, and what was found for them. Python's SceneCollisions and others.
template <typename Found, typename Begin = std::size_t>
struct OfBodyPairs : Bound {
  std::vector<std::array<std::int64_t, 2>> bodies;
  std::vector<Begin> begins;
  Found found;
};

using SceneClass = py::class_<LockedScene>;

/// Copies of Scene.
void bindSceneState(SceneClass& scene);
/// The queries of Scene; their results.
void bindSceneQueries(SceneClass& scene);
void bindSceneResults(py::module_& module);
/// Those of all pairs of bodies, likewise.
void bindScenePairs(SceneClass& scene);
void bindScenePairResults(py::module_& module);

}  // namespace adaptive_bvh::python
