#include "scene.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "arrays.h"
#include "locked_scene.h"
#include "objects.h"
#include "shapes.h"
#include "text.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kScene =
    R"(Many bodies: meshes that deform, and shapes. One tree of boxes over the bodies finds the pairs
that may be near. Call `update` after all changes of a step, before its first query: a query raises
RuntimeError when something has changed since.

Shapes are filled, and pairs of two shapes count as any other: `ignore` or groups leave out those
that may overlap. A shape is a body without triangles: results have -1 there. Bodies are named by numbers that `add` gives, each once. Results
are sorted by body, the smaller number of a pair first, and are in the world. ValueError on a number
that no body has, and on a distance that is negative or NaN; the scene is then as it was.

Thread-safe: threads share a lock for queries, and take it for themselves for changes.)";

constexpr const char* kAdd =
    R"(Adds a body, a DeformableMesh of the scene's dtype or a shape. Several bodies may share one.
Returns its number.

tf: pose that places it in the world.
group, mask: bits; two bodies are a pair where each one's mask has a bit of the other's group.
self_collision: whether the queries of pairs include the mesh with itself, without triangles that
    share a vertex. ValueError for a shape.
solid: whether the mesh is filled: bodies inside of it touch it, for `collisions` and `is_nearer`.
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

/// A function of Python's that a scene calls. LockedScene owns it.
class PythonFilter {
 public:
  PythonFilter(py::handle function, const LockedScene& scene)
      : function_(function), scene_(scene) {}

  bool operator()(BodyId first, BodyId second) const {
    const py::gil_scoped_acquire gil;
    const CallbackScope scope(&scene_);
    const int is_true = PyObject_IsTrue(function_(first, second).ptr());
    if (is_true < 0) throw py::error_already_set();
    return is_true != 0;
  }

 private:
  py::handle function_;
  const LockedScene& scene_;
};

/// Null of an object whose __init__ was not called.
LockedScene* constructedScene(PyObject* object) {
  const auto holder = reinterpret_cast<py::detail::instance*>(object)->get_value_and_holder();
  return holder.holder_constructed() ? static_cast<LockedScene*>(holder.value_ptr()) : nullptr;
}

/// Shows the filter to Python's garbage collector: it may refer to what owns the scene.
void addGarbageCollection(PyHeapTypeObject* heap_type) {
  PyTypeObject& type = heap_type->ht_type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* object, visitproc visit, void* arg) -> int {
    Py_VISIT(Py_TYPE(object));
    if (LockedScene* scene = constructedScene(object)) Py_VISIT(scene->filter().ptr());
    return 0;
  };
  type.tp_clear = [](PyObject* object) -> int {
    if (LockedScene* scene = constructedScene(object)) scene->clearFilter();
    return 0;
  };
}

/// Python's BodyOptions.
struct OptionsOfBody : Bound {
  BodyOptions options;
};

BodyOptions optionsOf(std::uint32_t group, std::uint32_t mask, bool self_collision, bool solid,
                      std::uintptr_t user) {
  BodyOptions options;
  options.group = group;
  options.mask = mask;
  options.self_collision = self_collision;
  options.solid = solid;
  options.user = user;
  return options;
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

LockedScene::LockedScene(const py::object& dtype) {
  const py::dtype type = py::dtype::from_args(dtype);
  if (type.equal(py::dtype::of<float>()))
    scene_.emplace<Scene<float>>();
  else if (!type.equal(py::dtype::of<double>()))
    throw py::type_error("dtype is " + std::string(py::str(py::handle(type))) +
                         "; float64 or float32 is needed");
}

std::vector<std::shared_lock<std::shared_mutex>> LockedScene::lockMeshes(
    std::set<const LockedMesh*> meshes) const {
  for (const auto& entry : meshes_) meshes.insert(entry.second.get());
  return LockedMesh::shareAll(meshes);
}

BodyId LockedScene::add(const py::object& body, const py::object& tf, const BodyOptions& options) {
  const fcl::Transform3d pose = poseFrom(tf, "tf");
  std::shared_ptr<LockedMesh> mesh;
  std::optional<Shape> shape;
  if (py::isinstance<LockedMesh>(body))
    mesh = body.cast<LockedMesh&>().shared_from_this();
  else if (py::isinstance<Shape>(body))
    shape = body.cast<Shape>();
  else
    throw py::type_error("a body must be a DeformableMesh or a Shape, not " +
                         std::string(py::str(py::type::of(body).attr("__name__"))));
  if (mesh && mesh->isDouble() != isDouble())
    throw std::invalid_argument("the mesh has other numbers than the scene; give both one dtype");
  const void* of_mesh = nullptr;  // it stays where it is
  if (mesh) mesh->query([&](const auto& m) { of_mesh = &m; });
  const BodyId id = change([&](auto& scene) {
    using S = SceneScalar<decltype(scene)>;
    std::shared_ptr<const fcl::CollisionGeometry<S>> geometry;
    if (mesh)
      geometry = {mesh, static_cast<const DeformableMesh<S>*>(of_mesh)};
    else
      geometry = shape->geometryPointer<S>();
    const BodyId number = scene.add(std::move(geometry), poseAs<S>(pose), options);
    if (mesh) meshes_.emplace_back(number, mesh);
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
  });
  geometries_.erase(body);
}

void LockedScene::setTransform(BodyId body, const py::object& tf) {
  const fcl::Transform3d pose = poseFrom(tf, "tf");
  change(
      [&](auto& scene) { scene.setTransform(body, poseAs<SceneScalar<decltype(scene)>>(pose)); });
}

py::array LockedScene::transform(BodyId body) const {
  using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const Matrix pose = query([&](const auto& scene) -> Matrix {
    return scene.transform(body).matrix().template cast<double>();
  });
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
  change([&](auto& scene) {
    using Filter = typename std::decay_t<decltype(scene)>::Filter;
    scene.setFilter(function.is_none() ? Filter() : Filter(PythonFilter(function, *this)));
    const py::gil_scoped_acquire gil;
    std::swap(filter_, function);  // under the lock: no query calls the one before any more
  });
}

void LockedScene::clearFilter() {
  std::visit([](auto& scene) { scene.setFilter({}); }, scene_);
  filter_ = py::none();
}

namespace {

void bindOptions(py::module_& module) {
  py::class_<OptionsOfBody>(module, "BodyOptions", "What a Scene knows of a body beside its shape.")
      .def_property_readonly(
          "group", [](const OptionsOfBody& self) { return self.options.group; },
          "Bits: the groups that the body belongs to.")
      .def_property_readonly(
          "mask", [](const OptionsOfBody& self) { return self.options.mask; },
          "Bits: the groups that the body meets.")
      .def_property_readonly(
          "self_collision", [](const OptionsOfBody& self) { return self.options.self_collision; },
          "Whether queries of pairs include the mesh with itself.")
      .def_property_readonly(
          "solid", [](const OptionsOfBody& self) { return self.options.solid; },
          "Whether the mesh is filled.")
      .def_property_readonly(
          "user", [](const OptionsOfBody& self) { return self.options.user; },
          "A number of the caller's.")
      .def("__repr__", TextOf({"group", "mask", "self_collision", "solid", "user"}));
}

void bindBodies(SceneClass& scene) {
  scene
      .def(
          "add",
          [](LockedScene& self, const py::object& body, const py::object& tf, std::uint32_t group,
             std::uint32_t mask, bool self_collision, bool solid, std::uintptr_t user) {
            return self.add(body, tf, optionsOf(group, mask, self_collision, solid, user));
          },
          py::arg("body"), py::arg("tf") = py::none(), py::kw_only(), py::arg("group") = 1,
          py::arg("mask") = 0xffffffffu, py::arg("self_collision") = false,
          py::arg("solid") = false, py::arg("user") = 0, docs::kAdd)
      .def("remove", &LockedScene::remove, py::arg("body"),
           "Removes a body. Its number is not given again.")
      .def("set_transform", &LockedScene::setTransform, py::arg("body"), py::arg("tf"),
           "Moves a body; tf is a pose.")
      .def("transform", &LockedScene::transform, py::arg("body"),
           "(4, 4) float64: the pose of a body.")
      .def("geometry", &LockedScene::geometry, py::arg("body"),
           "The DeformableMesh or Shape that `add` was given.")
      .def(
          "set_options",
          [](LockedScene& self, BodyId body, std::uint32_t group, std::uint32_t mask,
             bool self_collision, bool solid, std::uintptr_t user) {
            self.change([&](auto& s) {
              s.setOptions(body, optionsOf(group, mask, self_collision, solid, user));
            });
          },
          py::arg("body"), py::kw_only(), py::arg("group") = 1, py::arg("mask") = 0xffffffffu,
          py::arg("self_collision") = false, py::arg("solid") = false, py::arg("user") = 0,
          docs::kSetOptions)
      .def(
          "options",
          [](const LockedScene& self, BodyId body) {
            return OptionsOfBody{
                {}, self.query([&](const auto& s) { return BodyOptions(s.options(body)); })};
          },
          py::arg("body"), "BodyOptions of a body.")
      .def_property_readonly(
          "bodies",
          [](const LockedScene& self) {
            const auto ids = self.query([](const auto& s) { return s.bodies(); });
            const auto count = static_cast<py::ssize_t>(ids.size());
            return adopt<std::int64_t>(std::vector<std::int64_t>(ids.begin(), ids.end()), {count});
          },
          "(B,) int64: the numbers of all bodies, by increasing number.")
      .def(
          "__contains__",
          [](const LockedScene& self, std::int64_t body) {
            return body >= 0 && body <= std::numeric_limits<BodyId>::max() &&
                   self.query([&](const auto& s) { return s.contains(static_cast<BodyId>(body)); });
          },
          py::arg("body"), "Whether a body has this number.")
      .def("__len__",
           [](const LockedScene& self) {
             return self.query([](const auto& s) { return s.size(); });
           })
      .def("__repr__", [](const LockedScene& self) {
        const std::size_t count = self.query([](const auto& s) { return s.size(); });
        return "<adaptive_bvh.Scene: " + std::to_string(count) + " bodies, " +
               (self.isDouble() ? "float64" : "float32") + ">";
      });
}

void bindPairRules(SceneClass& scene) {
  scene
      .def(
          "ignore",
          [](LockedScene& self, BodyId a, BodyId b) {
            self.change([&](auto& s) { s.ignore(a, b); });
          },
          py::arg("first"), py::arg("second"), "Leaves a pair of bodies out.")
      .def(
          "unignore",
          [](LockedScene& self, BodyId a, BodyId b) {
            self.change([&](auto& s) { s.unignore(a, b); });
          },
          py::arg("first"), py::arg("second"),
          "Lets a pair count again that `ignore` or `ignore_neighbours` left out.")
      .def(
          "ignore_neighbours",
          [](LockedScene& self, const std::vector<BodyId>& chain) {
            self.change([&](auto& s) { s.ignoreNeighbours(chain); });
          },
          py::arg("chain"),
          "Leaves out bodies that follow each other in `chain`, a list of numbers: the links of a "
          "kinematic chain.")
      .def("set_filter", &LockedScene::setFilter, py::arg("filter"), docs::kSetFilter);
}

void bindSteps(SceneClass& scene) {
  scene
      .def(
          "begin_step", [](LockedScene& self) { self.change([](auto& s) { s.beginStep(); }); },
          "Remembers all poses: where the step of `earliest_impact` begins. A body that is added "
          "later begins where it is.")
      .def(
          "update", [](LockedScene& self) { self.changeWithMeshes([](auto& s) { s.update(); }); },
          "Computes the boxes of all bodies: after all changes of a step, before its first query.")
      .def(
          "set_threads",
          [](LockedScene& self, int threads) {
            self.change([&](auto& s) { s.setThreads(threads); });
          },
          py::arg("threads"),
          "Lets queries use so many threads, 1 or more. Results stay the same.");
}

}  // namespace

void bindScene(py::module_& module) {
  bindOptions(module);
  bindSceneResults(module);
  SceneClass scene(module, "Scene", docs::kScene, py::custom_type_setup(&addGarbageCollection));
  scene.def(py::init<const py::object&>(), py::arg("dtype") = "float64",
            "dtype: the numbers of all meshes, float64 or float32; others are a TypeError.");
  bindBodies(scene);
  bindPairRules(scene);
  bindSteps(scene);
  bindSceneQueries(scene);
}

}  // namespace adaptive_bvh::python
