#include "recording.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.h"
#include "meshes.h"
#include "objects.h"
#include "query.h"
#include "recording_docs.h"
#ifdef ADAPTIVE_BVH_PYTHON_RECORDING
#include "adaptive_bvh/recording.h"
#endif

namespace adaptive_bvh::python {
namespace {

/// The arguments of Python's constructor.
struct RecordingArguments {
  std::string title, unit;
  double frames_per_second;
  py::object up;
};

/// What Python passes of a frame.
struct FrameArguments {
  const Nearest* distance;
  const Contacts* contacts;
  std::optional<double> update_ms, query_ms;
  std::optional<py::dict> clearance;
  std::string note;
};

#ifdef ADAPTIVE_BVH_PYTHON_RECORDING
fcl::Vector3d rowOf(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

std::vector<VertexValues> clearancesFrom(const py::dict& bodies) {
  std::vector<VertexValues> all;
  for (const auto& [body, values] : bodies) {
    const auto numbers = py::array_t<double, int(py::array::c_style) | int(py::array::forcecast)>(
        numbersFrom(py::reinterpret_borrow<py::object>(values), "clearance"));
    if (numbers.ndim() != 1)
      throw py::value_error("clearance has the shape " + shapeOf(numbers) + "; (N,) is needed");
    if (!py::isinstance<py::int_>(body))
      throw py::type_error("clearance: a key is not the number of a body");
    all.push_back({body.cast<int>(), {numbers.data(), numbers.data() + numbers.size()}});
  }
  return all;
}

FrameResults resultsFrom(const FrameArguments& a) {
  FrameResults results;
  if (a.distance) {
    results.distance = a.distance->distance;
    const double* points = a.distance->points.data();
    results.nearest_points.push_back({rowOf(points), rowOf(points + 3)});
  }
  if (a.contacts) {
    const auto count = static_cast<std::size_t>(a.contacts->depths.shape(0));
    results.contact_count = count;
    for (std::size_t i = 0; i < count; ++i)
      results.contacts.push_back(rowOf(a.contacts->points.data() + 3 * i));
  }
  results.update_ms = a.update_ms;
  results.query_ms = a.query_ms;
  if (a.clearance) results.clearance = clearancesFrom(*a.clearance);
  results.note = a.note;
  return results;
}

/// The library's, with the meshes that it reads.
class RecordingOfMeshes : public Bound {
 public:
  explicit RecordingOfMeshes(const RecordingArguments& a) : recording_(optionsFrom(a)) {}

  int add(const py::object& body, const py::object& tf, const std::string& name) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    if (!py::isinstance<LockedMesh>(body)) return recording_.add(arraysOf(body), pose, name);
    const std::shared_ptr<LockedMesh> mesh = body.cast<LockedMesh&>().shared_from_this();
    const int number = mesh->query([&](const auto& m) {
      return recording_.add(m, poseAs<ScalarOf<std::decay_t<decltype(m)>>>(pose), name);
    });
    // In one order for all threads: see LockedMesh::PairLock.
    const auto at = std::lower_bound(meshes_.begin(), meshes_.end(), mesh);
    if (at == meshes_.end() || *at != mesh) meshes_.insert(at, mesh);
    return number;
  }
  void place(int body, const py::object& tf) { recording_.place(body, poseFrom(tf, "tf")); }
  void frame(const FrameArguments& arguments) {
    const FrameResults results = resultsFrom(arguments);
    const py::gil_scoped_release nogil;
    std::vector<std::shared_lock<std::shared_mutex>> locks;
    for (const auto& mesh : meshes_) locks.push_back(mesh->share());
    recording_.frame(results);
  }
  void write(const py::object& path) const {
    const std::string name = pathFrom(path);
    const py::gil_scoped_release nogil;
    recording_.write(name);
  }
  int bodies() const { return recording_.bodies(); }
  int frames() const { return recording_.frames(); }
  std::size_t bytes() const { return recording_.bytes(); }

 private:
  static RecordingOptions optionsFrom(const RecordingArguments& a) {
    RecordingOptions options;
    options.title = a.title;
    options.unit = a.unit;
    options.volume_depth = -1;  // a DeformableMesh has none
    options.frames_per_second = a.frames_per_second;
    options.up = pointFrom<double>(a.up, "up");
    return options;
  }
  static TriangleMesh<double> arraysOf(const py::object& body) {
    if (!py::hasattr(body, "vertices") || !py::hasattr(body, "faces"))
      throw py::type_error("body is a " +
                           std::string(py::str(py::type::of(body).attr("__name__"))) +
                           "; a DeformableMesh, or an object with vertices and faces is needed");
    return meshFrom(body.attr("vertices"), body.attr("faces"));
  }

  Recording recording_;
  std::vector<std::shared_ptr<LockedMesh>> meshes_;  ///< by address, each once
};
#else
/// Cannot be made.
class RecordingOfMeshes : public Bound {
 public:
  explicit RecordingOfMeshes(const RecordingArguments&) {
    throw std::runtime_error(
        "adaptive_bvh was built without the component recording (libjs-three)");
  }
  int add(const py::object&, const py::object&, const std::string&) { return 0; }
  void place(int, const py::object&) {}
  void frame(const FrameArguments&) {}
  void write(const py::object&) const {}
  int bodies() const { return 0; }
  int frames() const { return 0; }
  std::size_t bytes() const { return 0; }
};
#endif

}  // namespace

void bindRecording(py::module_& module) {
  using R = RecordingOfMeshes;
  py::class_<R>(module, "Recording", docs::kRecording)
      .def(py::init([](const std::string& title, const std::string& unit, double frames_per_second,
                       const py::object& up) {
             return std::make_unique<R>(RecordingArguments{title, unit, frames_per_second, up});
           }),
           py::kw_only(), py::arg("title") = "A run", py::arg("unit") = "",
           py::arg("frames_per_second") = 25.0, py::arg("up") = py::make_tuple(0, 0, 1),
           docs::kRecordingInit)
      .def("add", &R::add, py::arg("body"), py::arg("tf") = py::none(), py::kw_only(),
           py::arg("name") = "", docs::kRecordingAdd)
      .def("place", &R::place, py::arg("body"), py::arg("tf"),
           "The pose of the body with this number from the next frame on.")
      .def(
          "frame",
          [](R& self, const Nearest* distance, const Contacts* contacts,
             std::optional<double> update_ms, std::optional<double> query_ms,
             std::optional<py::dict> clearance, const std::string& note) {
            self.frame({distance, contacts, update_ms, query_ms, std::move(clearance), note});
          },
          py::arg("distance") = py::none(), py::arg("contacts") = py::none(), py::kw_only(),
          py::arg("update_ms") = py::none(), py::arg("query_ms") = py::none(),
          py::arg("clearance") = py::none(), py::arg("note") = "", docs::kRecordingFrame)
      .def("write", &R::write, py::arg("path"),
           "Writes the page: one file of about 0.9 megabytes and 4/3 of num_bytes.")
      .def_property_readonly("num_bodies", &R::bodies, "How many bodies were added.")
      .def_property_readonly("num_frames", &R::frames, "How many frames were recorded.")
      .def_property_readonly("num_bytes", &R::bytes, "What they take in memory, about, bytes.");
}

}  // namespace adaptive_bvh::python
