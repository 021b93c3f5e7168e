#include "adaptive_bvh/recording.h"

#include <array>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.h"
#include "bind.h"
#include "contact_regions.h"
#include "locked_scene.h"
#include "meshes.h"
#include "objects.h"

// What Python's Recording stands on. adaptive_bvh/_recording.py checks the arguments, and has the
// docstrings.
namespace adaptive_bvh::python {
namespace {

/// The base of Python's Recording: the library's, what it reads, and a lock. The lock comes before
/// those of a scene and of meshes. All are only held without the GIL.
class LockedRecording : public Bound {
 public:
  explicit LockedRecording(const RecordingOptions& options) : recording_(options) {}

  int addMesh(const LockedMesh& mesh, const py::object& tf, const std::string& name) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    return alone([&] {
      const auto lock = mesh.share();
      const int number = recording_.add(mesh.mesh(), pose, name);
      meshes_.push_back(mesh.shared_from_this());
      return number;
    });
  }
  int addShape(const Shape& shape, const py::object& tf, const std::string& name) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    return alone([&] { return recording_.add(shape.geometry(), pose, name); });
  }
  int addArrays(const py::object& vertices, const py::object& faces, const py::object& tf,
                const std::string& name) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    const TriangleMesh mesh = meshFrom(vertices, faces);
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
  void frame(const FrameResults& results) {
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
  /// A property that one of the library's functions counts.
  template <typename Number>
  static auto count(Number (Recording::*of)() const) {
    return
        [of](LockedRecording& self) { return self.alone([&] { return (self.recording_.*of)(); }); };
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
  /// Called by the library, without the GIL and with all locks.
  static std::string nameOf(BodyId id, const py::object& function) {
    const py::gil_scoped_acquire gil;
    const CallbackScope scope(nullptr);
    const py::object name = function(id);
    if (!py::isinstance<py::str>(name))
      throw py::type_error("name returned a " + typeNameOf(name) + "; a string is needed");
    return name.cast<std::string>();
  }

  std::mutex mutex_;
  Recording recording_;
  std::vector<std::shared_ptr<const LockedMesh>> meshes_;
  const LockedScene* scene_ = nullptr;
  py::object followed_ = py::none();  ///< keeps the scene alive; only touched with the GIL
  std::shared_ptr<py::object> name_;  ///< likewise; the library calls it
};

// ---- what a frame shows beside its bodies -------------------------------------------------------

/// Appends the rows of an array that has the right shape.
template <typename T>
void append(const Contiguous<double>& numbers, std::vector<T>& rows) {
  const T* begin = reinterpret_cast<const T*>(numbers.data());
  rows.insert(rows.end(), begin, begin + numbers.shape(0));
}
template <typename T>
std::vector<T> rowsIn(const Contiguous<double>& numbers) {
  std::vector<T> rows;
  append(numbers, rows);
  return rows;
}

std::vector<std::uint64_t> patchNumbersFrom(const py::object& numbers, const std::string& name) {
  const std::vector<unsigned> small = indicesFrom(numbers, std::numeric_limits<unsigned>::max(),
                                                  name.c_str(), "numbers of patches");
  return {small.begin(), small.end()};
}

/// Triangles, and the number of a patch for each.
void addPatches(FrameResults& results, int body, const py::object& triangles,
                const py::object& numbers, const std::string& name) {
  results.patches.push_back({body,
                             indicesFrom(triangles, std::numeric_limits<int>::max(),
                                         (name + "[0]").c_str(), "triangles at most"),
                             patchNumbersFrom(numbers, name + "[1]")});
}

/// The triangles of regions, and an identity for each region, or None.
void addRegions(FrameResults& results, int body, const ContactPatches& regions,
                const py::object& ids, const std::string& name) {
  const ContactPatches checked = checkedPatches(regions, name);
  if (ids.is_none()) {
    results.colourTriangles(body, checked);
    return;
  }
  const std::vector<std::uint64_t> numbers = patchNumbersFrom(ids, name + "[1]");
  if (numbers.size() + 1 != checked.begins.size())
    throw py::value_error(name + " has " + std::to_string(numbers.size()) + " ids for " +
                          std::to_string(checked.begins.size() - 1) + " regions");
  results.colourTriangles(body, checked, numbers);
}

void bindFrameResults(py::module_& module) {
  using R = FrameResults;
  using Numbers = Contiguous<double>;
  using Label = std::string;
  module.def("_numbers", &numbersFrom);
  py::class_<R>(module, "_FrameResults")
      .def(py::init<>())
      .def_readwrite("distance", &R::distance)
      .def_readwrite("update_ms", &R::update_ms)
      .def_readwrite("query_ms", &R::query_ms)
      .def_readwrite("note", &R::note)
      .def_readwrite("time", &R::time)
      .def("add_to_series", &R::addToSeries)
      .def("add_nearest_points",
           [](R& r, const Numbers& pairs) { append(pairs, r.nearest_points); })
      .def("add_contacts",
           [](R& r, const Numbers& points) {
             append(points, r.contacts);
             r.contact_count = r.contacts.size();
           })
      .def("add_vertex_distances",
           [](R& r, int body, const Numbers& values) {
             r.addVertexDistances(body, rowsIn<double>(values));
           })
      .def("add_arrows",
           [](R& r, const Label& label, const Numbers& from, const Numbers& along, double scale) {
             r.arrows.push_back(
                 {label, rowsIn<fcl::Vector3d>(from), rowsIn<fcl::Vector3d>(along), scale});
           })
      .def("add_segments",
           [](R& r, const Label& label, const Numbers& pairs) {
             r.segments.push_back({label, rowsIn<std::array<fcl::Vector3d, 2>>(pairs)});
           })
      .def("add_patches", &addPatches)
      .def("add_regions", &addRegions);
}

}  // namespace

void bindRecording(py::module_& module) {
  bindFrameResults(module);
  using R = LockedRecording;
  py::class_<R>(module, "_Recording", py::custom_type_setup(&collectGarbage<R>))
      .def(py::init([](const std::string& title, const std::string& unit, double frames_per_second,
                       const py::object& up, const std::string& time_unit,
                       const std::optional<std::array<double, 2>>& vertex_distance_range) {
        RecordingOptions options;
        options.title = title;
        options.unit = unit;
        options.volume_depth = -1;  // a DeformableMesh has none
        options.frames_per_second = frames_per_second;
        options.up = pointFrom(up, "up");
        options.time_unit = time_unit;
        options.vertex_distance_range = vertex_distance_range;
        return std::make_unique<R>(options);
      }))
      .def("add", &R::addMesh)
      .def("add", &R::addShape)
      .def("add", &R::addArrays)
      .def("remove", &R::remove)
      .def("place", &R::place)
      .def("follow", &R::follow)
      .def("body_of", &R::bodyOf)
      .def("frame", &R::frame)
      .def("write", &R::write)
      .def("html", &R::html)
      .def_property_readonly("num_bodies", R::count(&Recording::bodies))
      .def_property_readonly("num_frames", R::count(&Recording::frames))
      .def_property_readonly("num_bytes", R::count(&Recording::bytes));
}

}  // namespace adaptive_bvh::python
