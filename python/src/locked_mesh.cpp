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

#include "adaptive_bvh/write_file.h"
#include "arrays.h"
#include "bind.h"
#include "locked_mesh_docs.h"
#include "meshes.h"
#include "results.h"
#include "shapes.h"
#include "wrong_type.h"

namespace adaptive_bvh::python {
namespace {

/// In a file or pickle before a mesh of float32, whose positions are float64 there.
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

Mesh makeMesh(const std::pair<py::object, py::object>& arrays, bool is_single) {
  const Rows rows(arrays.first, "vertices", is_single);
  requireCount(rows.size(), "vertices");
  std::vector<fcl::Triangle> triangles = trianglesFrom(arrays.second, rows.size());
  requireCount(triangles.size(), "faces");
  const py::gil_scoped_release nogil;
  return Mesh({rows.begin(), rows.end()}, std::move(triangles));
}

/// A mesh of float32 numbers, as earlier versions saved it. Its tree is built anew.
Mesh loadSingle(std::istream& in) {
  const auto saved = DeformableMesh<float>::load(in);
  const auto in_double = [](const std::vector<fcl::Vector3f>& points) {
    std::vector<fcl::Vector3d> result;
    for (const fcl::Vector3f& point : points) result.push_back(point.cast<double>());
    return result;
  };
  if (saved.previousVertices().empty()) return Mesh(in_double(saved.vertices()), saved.triangles());
  Mesh mesh(in_double(saved.previousVertices()), saved.triangles());
  mesh.updateTwoFrames(in_double(saved.vertices()));
  return mesh;
}

}  // namespace

bool isSingle(const py::object& dtype) {
  const py::dtype type = dtype.is_none() ? py::dtype::of<double>() : py::dtype::from_args(dtype);
  // Not dtype::itemsize(): pybind11 before 2.12 reads it where NumPy 1 has it.
  const int bytes = type.attr("itemsize").cast<int>();
  if (type.kind() == 'f' && bytes == 8) return false;
  if (type.kind() == 'f' && bytes == 4) return true;
  throw py::type_error("dtype is " + std::string(py::str(py::handle(type))) +
                       "; float64 or float32 is needed");
}

LockedMesh::LockedMesh(const py::object& vertices, const py::object& faces, const py::object& dtype)
    : LockedMesh(makeMesh(arraysOf(vertices, faces), isSingle(dtype)), isSingle(dtype)) {}

LockedMesh::LockedMesh(Mesh&& mesh, bool is_single)
    : mesh_(std::move(mesh)),
      is_single_(is_single),
      num_vertices_(mesh_.vertices().size()),
      num_faces_(mesh_.triangles().size()) {}

MeshUpdate LockedMesh::update(const py::object& vertices) {
  const StridedRows rows(vertices, "vertices");
  requireRows(rows.array(), num_vertices_, "vertices");
  return change([&](Mesh& mesh) {
    return rows.visit([&](const auto& matrix) -> MeshUpdate {
      if constexpr (std::is_same_v<typename std::decay_t<decltype(matrix)>::Scalar, double>) {
        if (!is_single_) return mesh.update(matrix);
        converted_ = matrix.template cast<float>().template cast<double>();
      } else {
        converted_ = matrix.template cast<double>();
      }
      return mesh.update(converted_);
    });
  });
}

MeshUpdate LockedMesh::update(const py::object& indices, const py::object& vertices) {
  const std::vector<unsigned> names = indicesFrom(indices, num_vertices_, "indices", "vertices");
  const Rows rows(vertices, "vertices", is_single_);
  if (rows.size() != names.size())
    throw py::value_error("vertices has the shape " + shapeOf(rows.array()) + "; there are " +
                          std::to_string(names.size()) + " indices");
  return change([&](Mesh& mesh) -> MeshUpdate {
    return mesh.update(names.data(), rows.begin(), names.size());
  });
}

MeshUpdate LockedMesh::updateTwoFrames(const py::object& vertices) {
  const Rows rows(vertices, "vertices", is_single_);
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
  return query(
      [&](const Mesh& mesh) { return std::make_shared<LockedMesh>(Mesh(mesh), is_single_); });
}

void LockedMesh::save(std::ostream& out) const {
  query([&](const Mesh& mesh) {
    if (is_single_) out.write(kSingleMark.data(), kSingleMark.size());
    mesh.save(out);
  });
}

std::shared_ptr<LockedMesh> LockedMesh::load(std::istream& in) {
  std::array<char, 8> begin{};  // a mark, or the library's, whose last letter is the type's
  in.read(begin.data(), begin.size());
  in.clear();
  const bool is_single = begin == kSingleMark;
  if (!is_single) in.seekg(0);
  try {
    const py::gil_scoped_release nogil;
    if (begin.back() == 'f') return std::make_shared<LockedMesh>(loadSingle(in), true);
    return std::make_shared<LockedMesh>(Mesh::load(in), is_single);
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
  if (!is_single_)
    return readOnly(adopt(query([&](const Mesh& mesh) { return Points((mesh.*get)()); })));
  return readOnly(adopt(query([&](const Mesh& mesh) {
    std::vector<fcl::Vector3f> rounded;
    rounded.reserve((mesh.*get)().size());
    for (const fcl::Vector3d& point : (mesh.*get)()) rounded.push_back(point.cast<float>());
    return rounded;
  })));
}

py::array LockedMesh::faces() const {
  return readOnly(
      adopt(query([](const Mesh& mesh) { return std::vector<fcl::Triangle>(mesh.triangles()); })));
}

namespace {

using Class = py::class_<LockedMesh, std::shared_ptr<LockedMesh>>;

auto setThreads(void (Mesh::*set)(int)) {
  return [set](LockedMesh& self, int threads) {
    self.change([&](Mesh& mesh) { (mesh.*set)(threads); });
  };
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
      .def("set_update_threads", setThreads(&Mesh::setUpdateThreads), "threads"_a,
           docs::kUpdateThreads)
      .def("set_query_threads", setThreads(&Mesh::setQueryThreads), "threads"_a,
           docs::kQueryThreads);
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
    writeFile(name, write);
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
  mesh.def_property_readonly(
          "vertices", &LockedMesh::vertices,
          "A read-only copy of the present positions, (N, 3), of the mesh's dtype.")
      .def_property_readonly(
          "previous_vertices", &LockedMesh::previousVertices,
          "A read-only copy of the positions before the last update, where that was "
          "update_two_frames, of the mesh's dtype; (0, 3) otherwise.")
      .def_property_readonly("faces", &LockedMesh::faces,
                             "A read-only copy of the vertices of each triangle, (M, 3), int64.")
      .def_property_readonly("num_vertices", &LockedMesh::numVertices, "N: how many vertices.")
      .def_property_readonly("num_faces", &LockedMesh::numFaces, "M: how many triangles.")
      .def_property_readonly("dtype", &LockedMesh::dtype,
                             "float64 or float32: what positions are rounded to.");
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
  mesh.def(py::init<const py::object&, const py::object&, const py::object&>(), "vertices"_a,
           "faces"_a = py::none(), "dtype"_a = "float64", docs::kDeformableMeshInit)
      .def(
          "validate",
          [](const LockedMesh& self) {
            return self.query([](const Mesh& m) { return m.validate(); });
          },
          docs::kValidate)
      .def("__repr__", [](const LockedMesh& self) {
        return "<adaptive_bvh.DeformableMesh: " + std::to_string(self.numVertices()) +
               " vertices, " + std::to_string(self.numFaces()) + " faces, " +
               std::string(py::str(py::handle(self.dtype()))) + ">";
      });
  bindUpdates(mesh);
  bindCopies(mesh);
  bindFiles(mesh);
  bindProperties(mesh);
  module.def("_write_file", &writeBytes, "path"_a, "data"_a);
}

}  // namespace adaptive_bvh::python
