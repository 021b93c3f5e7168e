#include "locked_mesh.h"

#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "adaptive_bvh/detail/write_file.h"
#include "arrays.h"
#include "bind.h"
#include "locked_mesh_docs.h"
#include "meshes.h"
#include "results.h"
#include "shapes.h"
#include "wrong_type.h"

namespace adaptive_bvh::python {
namespace {

/// Before 0.3, a file or a pickle of a mesh in single precision could begin with this.
constexpr std::array<char, 8> kSingleMark = {'f', 'l', 'o', 'a', 't', '3', '2', '\n'};

/// The vertices and faces of a mesh object, or as they were passed.
std::pair<py::object, py::object> arraysOf(const py::object& vertices, const py::object& faces) {
  if (!faces.is_none()) return {vertices, faces};
  if (!py::hasattr(vertices, "vertices") || !py::hasattr(vertices, "faces"))
    throw py::type_error("faces are missing: vertices is " + typeNameOf(vertices) +
                         howToMesh(vertices));
  return {vertices.attr("vertices"), vertices.attr("faces")};
}

void requireCount(std::size_t count, const char* things) {
  if (count > static_cast<std::size_t>(1) << 30)
    throw py::value_error(std::string("too many ") + things + ": at most 2^30 are possible");
}

Mesh makeMesh(const std::pair<py::object, py::object>& arrays) {
  const Rows rows(arrays.first, "vertices");
  requireCount(rows.size(), "vertices");
  std::vector<fcl::Triangle> triangles = trianglesFrom(arrays.second, rows.size());
  requireCount(triangles.size(), "faces");
  const py::gil_scoped_release nogil;
  return Mesh({rows.begin(), rows.end()}, std::move(triangles));
}

}  // namespace

LockedMesh::LockedMesh(const py::object& vertices, const py::object& faces)
    : LockedMesh(makeMesh(arraysOf(vertices, faces))) {}

LockedMesh::LockedMesh(Mesh&& mesh)
    : mesh_(std::move(mesh)),
      num_vertices_(mesh_.vertices().size()),
      num_faces_(mesh_.triangles().size()) {}

MeshUpdate LockedMesh::update(const py::object& vertices) {
  const StridedRows rows(vertices, "vertices");
  requireRows(rows.array(), num_vertices_, "vertices");
  return change([&](Mesh& mesh) {
    return rows.visit([&](const auto& matrix) -> MeshUpdate {
      if constexpr (std::is_same_v<typename std::decay_t<decltype(matrix)>::Scalar, double>) {
        return mesh.update(matrix);
      } else {
        converted_ = matrix.template cast<double>();
        return mesh.update(converted_);
      }
    });
  });
}

MeshUpdate LockedMesh::update(const py::object& indices, const py::object& vertices) {
  const std::vector<unsigned> names = indicesFrom(indices, num_vertices_, "indices", "vertices");
  const Rows rows(vertices, "vertices");
  if (rows.size() != names.size())
    throw py::value_error("vertices has the shape " + shapeOf(rows.array()) + "; there are " +
                          std::to_string(names.size()) + " indices");
  return change([&](Mesh& mesh) -> MeshUpdate {
    return mesh.update(names.data(), rows.begin(), names.size());
  });
}

MeshUpdate LockedMesh::updateTwoFrames(const py::object& vertices) {
  const Rows rows(vertices, "vertices");
  requireRows(rows.array(), num_vertices_, "vertices");
  return change(
      [&](Mesh& mesh) -> MeshUpdate { return mesh.updateTwoFrames(rows.begin(), num_vertices_); });
}

void LockedMesh::refuseOthers(const py::handle& object) {
  if (py::isinstance<Shape>(object)) return;
  const std::string hint = howToMesh(object);
  if (!hint.empty())
    throw py::type_error("a DeformableMesh is needed, not " + typeNameOf(object) + hint);
}

std::shared_ptr<LockedMesh> LockedMesh::copy() const {
  return query([](const Mesh& mesh) { return std::make_shared<LockedMesh>(Mesh(mesh)); });
}

void LockedMesh::save(std::ostream& out) const {
  query([&](const Mesh& mesh) { mesh.save(out); });
}

std::shared_ptr<LockedMesh> LockedMesh::load(std::istream& in) {
  std::array<char, 8> begin{};
  in.read(begin.data(), begin.size());
  if (begin == kSingleMark)
    throw py::value_error(
        "the mesh was saved in single precision by a version before 0.3; build and save it anew");
  in.clear();
  in.seekg(0);
  try {
    const py::gil_scoped_release nogil;
    return std::make_shared<LockedMesh>(Mesh::load(in));
  } catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

namespace {

/// Makes an array read-only: a copy of the mesh's numbers, in which an assignment would be lost.
py::array readOnly(py::array&& copy) {
  copy.attr("flags").attr("writeable") = false;
  return std::move(copy);
}

}  // namespace

py::array LockedMesh::positions(const Points& (Mesh::*get)() const) const {
  return readOnly(adopt(query([&](const Mesh& mesh) { return Points((mesh.*get)()); })));
}

py::array LockedMesh::faces() const {
  return readOnly(
      adopt(query([](const Mesh& mesh) { return std::vector<fcl::Triangle>(mesh.triangles()); })));
}

namespace {

using Class = py::class_<LockedMesh, std::shared_ptr<LockedMesh>>;

void setThreads(LockedMesh& self, int threads) {
  self.change([&](Mesh& mesh) { mesh.setThreads(threads); });
}

void bindUpdates(Class& mesh) {
  mesh.def("update", py::overload_cast<const py::object&>(&LockedMesh::update), "vertices"_a,
           docs::kUpdate)
      .def("update", py::overload_cast<const py::object&, const py::object&>(&LockedMesh::update),
           "indices"_a, "vertices"_a, docs::kUpdateSome)
      .def("update_two_frames", &LockedMesh::updateTwoFrames, "vertices"_a, docs::kUpdateTwoFrames)
      .def_property_readonly(
          "last_update",
          [](const LockedMesh& self) {
            return self.query([](const Mesh& m) { return MeshUpdate(m.lastUpdate()); });
          },
          "What the last update did: a MeshUpdate.")
      .def("set_threads", &setThreads, "threads"_a, docs::kSetThreads);
}

/// Raises OSError by errno, or KeyboardInterrupt if Ctrl-C ended the wait for the other end of a
/// pipe.
[[noreturn]] void raiseForFile(const py::object& path) {
  if (errno != EINTR || PyErr_CheckSignals() == 0)
    PyErr_SetFromErrnoWithFilenameObject(PyExc_OSError, path.ptr());
  throw py::error_already_set();
}

/// Writes a file while other threads of Python run: one of them may read a pipe.
void writeTo(const py::object& path, const std::function<void(std::ostream&)>& write) {
  const std::string name = pathFrom(path);
  try {
    const py::gil_scoped_release nogil;
    detail::writeFile(name, write);
  } catch (const std::system_error& error) {
    errno = error.code().value();
    raiseForFile(path);
  }
}

void saveToFile(const LockedMesh& mesh, const py::object& path) {
  writeTo(path, [&](std::ostream& out) {
    const py::gil_scoped_acquire gil;
    mesh.save(out);
  });
}

/// For the package's own Python.
void writeBytes(const py::object& path, const std::string& bytes) {
  writeTo(path, [&](std::ostream& out) { out << bytes; });
}

std::shared_ptr<LockedMesh> loadFromFile(const py::object& path) {
  const std::string name = pathFrom(path);
  std::ifstream in(name, std::ios::binary);
  if (!in) raiseForFile(path);
  return LockedMesh::load(in);
}

void bindFiles(Class& mesh) {
  mesh.def("save", &saveToFile, "path"_a, docs::kSave)
      .def_static("load", &loadFromFile, "path"_a, docs::kLoad)
      .def(py::pickle(
          [](const LockedMesh& self) {
            std::ostringstream out;
            self.save(out);
            return py::bytes(out.str());
          },
          [](const py::bytes& state) {
            std::istringstream in{std::string(state)};
            return LockedMesh::load(in);
          }));
}

void bindCopies(Class& mesh) {
  mesh.def("copy", &LockedMesh::copy, docs::kCopy)
      .def("__copy__", &LockedMesh::copy)
      .def(
          "__deepcopy__", [](const LockedMesh& self, const py::dict&) { return self.copy(); },
          "memo"_a);
}

void bindProperties(Class& mesh) {
  mesh.def_property_readonly("vertices", &LockedMesh::vertices,
                             "A read-only copy of the present positions, (N, 3) float64.")
      .def_property_readonly(
          "previous_vertices", &LockedMesh::previousVertices,
          "A read-only copy of the positions before the last update, where that was "
          "update_two_frames, (N, 3) float64; (0, 3) otherwise.")
      .def_property_readonly("faces", &LockedMesh::faces,
                             "A read-only copy of the vertices of each triangle, (M, 3), int64.")
      .def_property_readonly("num_vertices", &LockedMesh::numVertices, "N: how many vertices.")
      .def_property_readonly("num_faces", &LockedMesh::numFaces, "M: how many triangles.");
}

void bindMeshUpdate(py::module_& module) {
  using U = MeshUpdate;
  ResultClass<U>(module, "MeshUpdate", "What an update did.")
      .attribute("vertices", &U::vertices, "How many positions were given.")
      .attribute("largest_displacement", &U::largest_displacement,
                 "The largest motion of a vertex, rounded up, in the unit of the mesh.")
      .attribute("turned", &U::turned,
                 "Whether the boxes lie along other axes since, because the body has turned.")
      .attribute("seconds", &U::seconds, "How long it took.");
}

}  // namespace

void bindLockedMesh(py::module_& module) {
  bindMeshUpdate(module);
  Class mesh(module, "DeformableMesh", docs::kDeformableMesh);
  mesh.def(py::init<const py::object&, const py::object&>(), "vertices"_a, "faces"_a = py::none(),
           docs::kDeformableMeshInit)
      .def(
          "validate",
          [](const LockedMesh& self) {
            return self.query([](const Mesh& m) { return m.validate(); });
          },
          docs::kValidate)
      .def("__repr__", [](const LockedMesh& self) {
        return "<adaptive_bvh.DeformableMesh: " + std::to_string(self.numVertices()) +
               " vertices, " + std::to_string(self.numFaces()) + " faces>";
      });
  bindUpdates(mesh);
  bindCopies(mesh);
  bindFiles(mesh);
  bindProperties(mesh);
  module.def("_write_file", &writeBytes, "path"_a, "data"_a);
}

}  // namespace adaptive_bvh::python
