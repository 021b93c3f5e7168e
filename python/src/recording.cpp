#include <algorithm>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.h"
#include "bind.h"
#include "frame_results.h"
#include "locked_scene.h"
#include "meshes.h"
#include "objects.h"
#include "recording_docs.h"

namespace adaptive_bvh::python {
namespace {

/// The arguments of Python's constructor.
struct RecordingArguments {
  std::string title, unit;
  double frames_per_second;
  py::object up;
};

#ifdef ADAPTIVE_BVH_PYTHON_RECORDING
/// Python's Recording: the library's, what it reads, and a lock. The lock comes before those of a
/// scene and of meshes. All are only held without the GIL.
class LockedRecording : public Bound {
 public:
  explicit LockedRecording(const RecordingArguments& a) : recording_(optionsFrom(a)) {}

  int add(const py::object& body, const py::object& tf, const std::string& name) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    if (const LockedMesh* mesh = asMesh(body)) return addMesh(mesh->shared_from_this(), pose, name);
    if (const Shape* shape = asShape(body))
      return alone([&] { return recording_.add(shape->geometry(), pose, name); });
    const TriangleMesh<double> mesh = arraysOf(body);
    return alone([&] { return recording_.add(mesh, pose, name); });
  }
  void remove(int body) {
    alone([&] { recording_.remove(body); });
  }
  void place(int body, const py::object& tf) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    alone([&] { recording_.place(body, pose); });
  }
  void follow(const py::object& scene, const py::object& name) {
    if (!py::isinstance<LockedScene>(scene))
      throw py::type_error("scene is a " + typeNameOf(scene) + "; a Scene is needed");
    if (!name.is_none() && !PyCallable_Check(name.ptr()))
      throw py::type_error("name must be a function, or None");
    const auto* const locked = &scene.cast<const LockedScene&>();
    const auto function = std::make_shared<py::object>(name);
    alone([&] {
      const auto locks = locked->share(meshSet());
      recording_.follow(locked->scene(), [function](BodyId id) { return nameOf(id, *function); });
      scene_ = locked;
    });
    followed_ = scene;
    name_ = function;
  }
  int bodyOf(BodyId id) {
    return reading([&] { return recording_.bodyOf(id); });
  }
  void frame(const FrameArguments& arguments) {
    const FrameResults results = frameResultsFrom(arguments);
    reading([&] { recording_.frame(results); });
  }
  void write(const py::object& path) {
    const std::string name = pathFrom(path);
    try {
      alone([&] { recording_.write(name); });
    } catch (const std::runtime_error& error) {  // it quotes the name, which may not be UTF-8
      const auto text = py::reinterpret_steal<py::object>(PyUnicode_DecodeFSDefault(error.what()));
      PyErr_SetObject(PyExc_RuntimeError, text.ptr());
      throw py::error_already_set();
    }
  }
  std::string html() {
    return alone([&] {
      std::ostringstream out;
      recording_.write(out);
      return out.str();
    });
  }
  int bodies() {
    return alone([&] { return recording_.bodies(); });
  }
  int frames() {
    return alone([&] { return recording_.frames(); });
  }
  std::size_t bytes() {
    return alone([&] { return recording_.bytes(); });
  }

  /// For Python's garbage collector: the function that names bodies may refer to this object.
  int visitFunction(visitproc visit, void* arg) const {
    Py_VISIT(followed_.ptr());
    if (name_) Py_VISIT(name_->ptr());
    return 0;
  }
  void clearFunction() {
    if (name_) *name_ = py::none();
  }

 private:
  /// Runs f() alone, without the GIL.
  template <typename F>
  std::invoke_result_t<F> alone(const F& f) {
    CallbackScope::refuseChange();
    const py::gil_scoped_release nogil;
    const std::lock_guard lock(mutex_);
    return f();
  }
  /// As above, with the locks of all that is read.
  template <typename F>
  std::invoke_result_t<F> reading(const F& f) {
    return alone([&] {
      LockedScene::Locks locks;
      if (scene_)
        locks = scene_->share(meshSet());
      else
        locks.meshes = LockedMesh::shareAll(meshSet());
      return f();
    });
  }
  std::set<const LockedMesh*> meshSet() const {
    std::set<const LockedMesh*> meshes;
    for (const auto& mesh : meshes_) meshes.insert(mesh.get());
    return meshes;
  }
  int addMesh(const std::shared_ptr<const LockedMesh>& mesh, const fcl::Transform3d& pose,
              const std::string& name) {
    return alone([&] {
      const auto lock = mesh->share();
      const int number = recording_.add(mesh->mesh(), pose, name);
      meshes_.push_back(mesh);
      return number;
    });
  }
  /// Called by the library, without the GIL and with all locks.
  static std::string nameOf(BodyId id, const py::object& function) {
    const py::gil_scoped_acquire gil;
    const CallbackScope scope(nullptr);
    if (function.is_none()) return "body " + std::to_string(id);
    const py::object name = function(id);
    if (!py::isinstance<py::str>(name))
      throw py::type_error("name returned a " + typeNameOf(name) + "; a string is needed");
    return name.cast<std::string>();
  }

  static RecordingOptions optionsFrom(const RecordingArguments& a) {
    RecordingOptions options;
    options.title = a.title;
    options.unit = a.unit;
    options.volume_depth = -1;  // a DeformableMesh has none
    options.frames_per_second = a.frames_per_second;
    options.up = pointFrom(a.up, "up");
    return options;
  }
  static TriangleMesh<double> arraysOf(const py::object& body) {
    if (!py::hasattr(body, "vertices") || !py::hasattr(body, "faces"))
      throw py::type_error("body is a " + typeNameOf(body) +
                           "; a DeformableMesh, a Shape, or an object with vertices and faces is "
                           "needed");
    return meshFrom(body.attr("vertices"), body.attr("faces"));
  }

  std::mutex mutex_;
  Recording recording_;
  std::vector<std::shared_ptr<const LockedMesh>> meshes_;
  const LockedScene* scene_ = nullptr;
  py::object followed_ = py::none();  ///< keeps the scene alive; only touched with the GIL
  std::shared_ptr<py::object> name_;  ///< likewise; the library calls it
};
#else
/// Cannot be made.
class LockedRecording : public Bound {
 public:
  explicit LockedRecording(const RecordingArguments&) {
    throw std::runtime_error(
        "adaptive_bvh was built without the component recording (libjs-three)");
  }
  int add(const py::object&, const py::object&, const std::string&) { return 0; }
  void remove(int) {}
  void place(int, const py::object&) {}
  void follow(const py::object&, const py::object&) {}
  int bodyOf(BodyId) { return 0; }
  void frame(const FrameArguments&) {}
  void write(const py::object&) {}
  std::string html() { return {}; }
  int bodies() { return 0; }
  int frames() { return 0; }
  std::size_t bytes() { return 0; }
  int visitFunction(visitproc, void*) const { return 0; }
  void clearFunction() {}
};
#endif

using RecordingClass = py::class_<LockedRecording>;

void bindRecordedBodies(RecordingClass& recording) {
  using R = LockedRecording;
  recording
      .def("add", &R::add, "body"_a, "tf"_a = py::none(), py::kw_only(), "name"_a = "",
           docs::kRecordingAdd)
      .def("remove", &R::remove, "body"_a, docs::kRecordingRemove)
      .def("place", &R::place, "body"_a, "tf"_a,
           "The pose of the body with this number from the next frame on.")
      .def("follow", &R::follow, "scene"_a, "name"_a = py::none(), docs::kRecordingFollow)
      .def("body_of", &R::bodyOf, "body"_a, docs::kRecordingBodyOf);
}

void bindFrames(RecordingClass& recording) {
  using R = LockedRecording;
  recording
      .def(
          "frame",
          [](R& self, const py::object& distance, const py::object& contacts,
             std::optional<double> update_ms, std::optional<double> query_ms,
             const py::object& nearest_points, const py::object& clearance,
             const py::object& arrows, const py::object& segments, const py::object& patches,
             const std::string& note) {
            self.frame({distance, contacts, update_ms, query_ms, nearest_points, clearance, arrows,
                        segments, patches, note});
          },
          "distance"_a = py::none(), "contacts"_a = py::none(), py::kw_only(),
          "update_ms"_a = py::none(), "query_ms"_a = py::none(), "nearest_points"_a = py::none(),
          "clearance"_a = py::none(), "arrows"_a = py::none(), "segments"_a = py::none(),
          "patches"_a = py::none(), "note"_a = "", docs::kRecordingFrame)
      .def("write", &R::write, "path"_a, docs::kRecordingWrite)
      .def("html", &R::html, docs::kRecordingHtml)
      .def_property_readonly("num_bodies", &R::bodies,
                             "How many bodies were added, including removed ones.")
      .def_property_readonly("num_frames", &R::frames, "How many frames were recorded.")
      .def_property_readonly("num_bytes", &R::bytes, "What they take in memory, about, bytes.");
}

}  // namespace

void bindRecording(py::module_& module) {
  RecordingClass recording(module, "Recording", docs::kRecording,
                           py::custom_type_setup(&collectGarbage<LockedRecording>));
  recording.def(py::init([](const std::string& title, const std::string& unit,
                            double frames_per_second, const py::object& up) {
                  return std::make_unique<LockedRecording>(
                      RecordingArguments{title, unit, frames_per_second, up});
                }),
                py::kw_only(), "title"_a = "A run", "unit"_a = "", "frames_per_second"_a = 25.0,
                "up"_a = py::make_tuple(0, 0, 1), docs::kRecordingInit);
  bindRecordedBodies(recording);
  bindFrames(recording);
}

}  // namespace adaptive_bvh::python
