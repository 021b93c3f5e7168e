#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "bind.h"
#include "locked_scene.h"
#include "objects.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kScene =
    R"(Many bodies: meshes that deform, and shapes. One tree of boxes over the bodies finds the pairs
that may be near. Call `update` after all changes of a step, before its first query: a query raises
RuntimeError when something has changed since.

Shapes are filled, and pairs of two shapes count as any other: `ignore` or groups leave out those
that may overlap. A shape is a body without triangles: results have -1 there. Bodies are named by
numbers that `add` gives, each once. Results are sorted by body, the smaller number of a pair first,
and are in the world. ValueError on a number that no body has, and on a distance that is negative or
NaN; the scene is then as it was.

Thread-safe: threads share a lock for queries, and take it for themselves for changes.)";

constexpr const char* kAdd =
    R"(Adds a body, a DeformableMesh or a shape. Several bodies may share one. Returns its number.

tf: pose that places it in the world.
group, mask: bits; two bodies are a pair where each one's mask has a bit of the other's group.
self_collision: whether the queries of pairs include the mesh with itself, without triangles that
    share a vertex. ValueError for a shape.
solid: whether the mesh is filled: bodies inside of it touch it, for `collide` and `is_nearer`.
    ValueError for a shape, which always is, and for an open mesh.
user: a number of your own, 0 or more.)";

constexpr const char* kSetOptions = "Replaces all options of a body, which are those of `add`.";

constexpr const char* kSetFilter =
    R"(Leaves out pairs by a function: filter(first, second) is called with the numbers of two bodies,
the smaller first, for each pair whose boxes are near and which nothing else leaves out; the pair
counts where it returns a true value. What it raises, the query raises. None admits all pairs.

The filter may run queries, also of the scene. RuntimeError where it changes a scene or a mesh, or
calls distance() or nearest(body), which keep their results as the start of the next call.)";
}  // namespace docs

namespace {

/// What a function of Python's that a scene calls says. LockedScene owns it.
bool admits(const py::handle& function, const LockedScene& scene, BodyId first, BodyId second) {
  const py::gil_scoped_acquire gil;
  const CallbackScope scope(&scene);
  const int is_true = PyObject_IsTrue(function(first, second).ptr());
  if (is_true < 0) throw py::error_already_set();
  return is_true != 0;
}

}  // namespace

const CallbackScope*& CallbackScope::innermost() {
  static thread_local const CallbackScope* innermost = nullptr;
  return innermost;
}

void CallbackScope::refuseChange() {
  if (innermost())
    throw std::logic_error(
        "a function that a query calls must not change a scene or a mesh, nor call distance() or "
        "nearest(body) of a scene: the query has locked them");
}

bool CallbackScope::holds(const void* mesh_or_scene) {
  bool holds = false;
  for (const CallbackScope* scope = innermost(); scope; scope = scope->outer_) {
    if (!scope->scene_)
      throw std::logic_error("a function that names bodies must not query a scene or a mesh");
    holds |= mesh_or_scene == scope->scene_ || scope->scene_->has(mesh_or_scene);
  }
  return holds;
}

std::vector<LockedMesh::SharedLock> LockedScene::lockMeshes(
    std::set<const LockedMesh*> meshes) const {
  for (const auto& entry : meshes_) meshes.insert(entry.second.get());
  return LockedMesh::shareAll(meshes);
}

BodyId LockedScene::add(const py::object& body, const py::object& tf, const BodyOptions& options) {
  std::shared_ptr<const fcl::CollisionGeometryd> geometry;
  std::shared_ptr<const LockedMesh> mesh;
  if (asMesh(body)) {
    mesh = asMesh(body)->shared_from_this();
    geometry = {mesh, &mesh->mesh()};
  } else if (asShape(body)) {
    geometry = asShape(body)->geometryPointer();
  } else {
    throw py::type_error("a body must be a DeformableMesh or a Shape, not " + typeNameOf(body) +
                         howToMesh(body));
  }
  const fcl::Transform3d pose = poseFrom(tf, "tf");
  const BodyId id = change([&](Scene& scene) {
    const BodyId number = scene.add(std::move(geometry), pose, options);
    if (mesh) meshes_.emplace_back(number, mesh);
    starts_[number] = pose;
    next_ = number + 1;
    return number;
  });
  geometries_[id] = body;
  return id;
}

void LockedScene::remove(BodyId body) {
  change([&](auto& scene) {
    scene.remove(body);
    const auto is_it = [&](const auto& entry) { return entry.first == body; };
    meshes_.erase(std::remove_if(meshes_.begin(), meshes_.end(), is_it), meshes_.end());
    starts_.erase(body);
  });
  geometries_.erase(body);
}

void LockedScene::setTransform(BodyId body, const py::object& tf) {
  const fcl::Transform3d pose = poseFrom(tf, "tf");
  change([&](Scene& scene) { scene.setTransform(body, pose); });
}

py::array LockedScene::transform(BodyId body) const {
  using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const Matrix pose =
      query([&](const Scene& scene) -> Matrix { return scene.transform(body).matrix(); });
  return py::array_t<double>({4, 4}, pose.data());
}

py::object LockedScene::geometry(BodyId body) const {
  const auto at = geometries_.find(body);
  if (at == geometries_.end())
    throw std::invalid_argument("there is no body " + std::to_string(body) + " in the scene");
  return at->second;
}

void LockedScene::setFilter(const py::object& filter) {
  if (!filter.is_none() && !PyCallable_Check(filter.ptr()))
    throw py::type_error("filter must be a function, or None");
  py::object function = filter;
  Scene::Filter calls;
  if (!function.is_none())
    calls = [this, handle = py::handle(function)](BodyId first, BodyId second) {
      return admits(handle, *this, first, second);
    };
  change([&](Scene& scene) {
    scene.setFilter(std::move(calls));
    const py::gil_scoped_acquire gil;
    std::swap(filter_, function);  // under the lock: no query calls the one before any more
  });
}

void LockedScene::clearFunction() {
  scene_.setFilter({});
  filter_ = py::none();
}

namespace {

void bindOptions(py::module_& module) {
  using O = BodyOptions;
  ResultClass<O>(module, "BodyOptions", "What a Scene knows of a body beside its shape.")
      .attribute("group", &O::group, "Bits: the groups that the body belongs to.")
      .attribute("mask", &O::mask, "Bits: the groups that the body meets.")
      .attribute("self_collision", &O::self_collision,
                 "Whether queries of pairs include the mesh with itself.")
      .attribute("solid", &O::solid, "Whether the mesh is filled.")
      .attribute("user", &O::user, "A number of the caller's.");
}

/// Defines a method with the arguments of BodyOptions at the end: method(self, options, ...).
template <typename Result, typename... First, typename... Names>
void defineWithOptions(SceneClass& scene, const char* name,
                       Result (*method)(LockedScene&, const BodyOptions&, First...),
                       const char* doc, const Names&... names) {
  scene.def(
      name,
      [method](LockedScene& self, First... first, std::uint32_t group, std::uint32_t mask,
               bool self_collision, bool solid, std::uintptr_t user) {
        return method(self, {group, mask, self_collision, solid, user}, first...);
      },
      names..., py::kw_only(), "group"_a = 1, "mask"_a = 0xffffffffu, "self_collision"_a = false,
      "solid"_a = false, "user"_a = 0, doc);
}

BodyId add(LockedScene& self, const BodyOptions& options, const py::object& body,
           const py::object& tf) {
  return self.add(body, tf, options);
}
void setOptions(LockedScene& self, const BodyOptions& options, BodyId body) {
  self.change([&](Scene& s) { s.setOptions(body, options); });
}

void bindBodies(SceneClass& scene) {
  defineWithOptions(scene, "add", &add, docs::kAdd, "body"_a, "tf"_a = py::none());
  defineWithOptions(scene, "set_options", &setOptions, docs::kSetOptions, "body"_a);
  scene
      .def("remove", &LockedScene::remove, "body"_a,
           "Removes a body. Its number is not given again.")
      .def("set_transform", &LockedScene::setTransform, "body"_a, "tf"_a,
           "Moves a body; tf is a pose.")
      .def("transform", &LockedScene::transform, "body"_a, "(4, 4) float64: the pose of a body.")
      .def("geometry", &LockedScene::geometry, "body"_a,
           "The DeformableMesh or Shape that `add` was given.")
      .def("options", reading(&Scene::options), "body"_a, "BodyOptions of a body.")
      .def_property_readonly(
          "bodies",
          [](const LockedScene& self) {
            const std::vector<BodyId> ids = self.query(&Scene::bodies);
            return adopt(std::vector<std::int64_t>(ids.begin(), ids.end()));
          },
          "(B,) int64: the numbers of all bodies, by increasing number.")
      .def(
          "__contains__",
          [](const LockedScene& self, std::int64_t body) {
            return body >= 0 && body <= std::numeric_limits<BodyId>::max() &&
                   self.query([&](const Scene& s) { return s.contains(BodyId(body)); });
          },
          "body"_a, "Whether a body has this number.")
      .def("__len__", reading(&Scene::size))
      .def("__repr__", [](const LockedScene& self) {
        return "<adaptive_bvh.Scene: " + std::to_string(self.query(&Scene::size)) + " bodies>";
      });
}

void bindPairRules(SceneClass& scene) {
  scene.def("ignore", &LockedScene::ignore, "first"_a, "second"_a, "Leaves a pair of bodies out.")
      .def("unignore", &LockedScene::unignore, "first"_a, "second"_a,
           "Lets a pair count again that `ignore` or `ignore_neighbours` left out.")
      .def("ignore_neighbours", &LockedScene::ignoreNeighbours, "chain"_a,
           "Leaves out bodies that follow each other in `chain`, a list of numbers: the links of a "
           "kinematic chain.")
      .def("set_filter", &LockedScene::setFilter, "filter"_a, docs::kSetFilter);
}

void bindSteps(SceneClass& scene) {
  scene
      .def("begin_step", &LockedScene::beginStep,
           "Remembers all poses: where the step of `earliest_impact` begins. A body that is added "
           "later begins where it is.")
      .def(
          "update", [](LockedScene& self) { self.changeWithMeshes([](Scene& s) { s.update(); }); },
          "Computes the boxes of all bodies: after all changes of a step, before its first query.")
      .def("set_threads", &LockedScene::setThreads, "threads"_a,
           "Lets queries use so many threads, 1 or more. Results stay the same.");
}

}  // namespace

void bindScene(py::module_& module) {
  bindOptions(module);
  bindSceneResults(module);
  SceneClass scene(module, "Scene", docs::kScene,
                   py::custom_type_setup(&collectGarbage<LockedScene>));
  scene.def(py::init<>());
  bindBodies(scene);
  bindPairRules(scene);
  bindSteps(scene);
  bindSceneState(scene);
  bindSceneQueries(scene);
}

}  // namespace adaptive_bvh::python
