#include "locked_mesh.h"

#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "adaptive_bvh/write_file.h"
#include "arrays.h"
#include "docs.h"
#include "meshes.h"
#include "text.h"

namespace adaptive_bvh::python {
namespace {

template <typename S>
using Point = Eigen::Matrix<S, 3, 1>;

/// True for float64. Throws py::type_error for what is neither.
bool isDoubleType(const py::object& dtype) {
  const py::dtype type = dtype.is_none() ? py::dtype::of<double>() : py::dtype::from_args(dtype);
  if (type.kind() == 'f' && type.itemsize() == 8) return true;
  if (type.kind() == 'f' && type.itemsize() == 4) return false;
  throw py::type_error("dtype is " + std::string(py::str(py::handle(type))) +
                       "; float64 or float32 is needed");
}

/// The vertices and faces of a mesh object, or as they were passed.
std::pair<py::object, py::object> arraysOf(const py::object& vertices, const py::object& faces) {
  if (!faces.is_none()) return {vertices, faces};
  if (!py::hasattr(vertices, "vertices") || !py::hasattr(vertices, "faces"))
    throw py::type_error(
        "faces are missing: pass vertices and faces, or an object that has both "
        "as attributes");
  return {vertices.attr("vertices"), vertices.attr("faces")};
}

void requireCount(std::size_t count, const char* things) {
  if (count > static_cast<std::size_t>(1) << 30)
    throw py::value_error(std::string("too many ") + things + ": at most 2^30 are possible");
}

template <typename S>
DeformableMesh<S> makeMesh(const py::object& vertices, const py::object& faces) {
  const Rows<S> rows = rowsFrom<S>(vertices, "vertices");
  const auto count = static_cast<std::size_t>(rows.shape(0));
  requireCount(count, "vertices");
  std::vector<fcl::Triangle> triangles = trianglesFrom(faces, count);
  requireCount(triangles.size(), "faces");
  const Point<S>* points = pointsOf<S>(rows);
  const py::gil_scoped_release nogil;
  return DeformableMesh<S>(std::vector<Point<S>>(points, points + count), std::move(triangles));
}

LockedMesh::Variant makeMeshes(const py::object& vertices, const py::object& faces,
                               const py::object& dtype) {
  const bool is_double = isDoubleType(dtype);
  const auto [rows, triangles] = arraysOf(vertices, faces);
  if (is_double) return makeMesh<double>(rows, triangles);
  return makeMesh<float>(rows, triangles);
}

template <typename S>
py::array rowsOf(std::vector<Point<S>>&& points) {
  const auto count = static_cast<py::ssize_t>(points.size());
  return adopt<S>(std::move(points), {count, 3});
}

}  // namespace

LockedMesh::LockedMesh(const py::object& vertices, const py::object& faces, const py::object& dtype)
    : LockedMesh(makeMeshes(vertices, faces, dtype)) {}

LockedMesh::LockedMesh(Variant&& meshes)
    : meshes_(std::move(meshes)),
      num_vertices_(std::visit([](const auto& m) { return m.vertices().size(); }, meshes_)),
      num_faces_(std::visit([](const auto& m) { return m.triangles().size(); }, meshes_)) {}

MeshUpdate LockedMesh::update(const py::object& vertices) {
  return withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const StridedRows<S> rows(vertices, "vertices");
    requireRows(rows.array(), num_vertices_, "vertices");
    return changeAs<S>([&](auto& mesh) -> MeshUpdate {
      return rows.isRowMajor() ? mesh.update(rows.rowMajor()) : mesh.update(rows.columnMajor());
    });
  });
}

MeshUpdate LockedMesh::update(const py::object& indices, const py::object& vertices) {
  const std::vector<unsigned> names = indicesFrom(indices, num_vertices_, "indices", "vertices");
  return withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(vertices, "vertices");
    if (static_cast<std::size_t>(rows.shape(0)) != names.size())
      throw py::value_error("vertices has the shape " + shapeOf(rows) + "; there are " +
                            std::to_string(names.size()) + " indices");
    const Point<S>* points = pointsOf<S>(rows);
    return changeAs<S>(
        [&](auto& mesh) -> MeshUpdate { return mesh.update(names.data(), points, names.size()); });
  });
}

MeshUpdate LockedMesh::updateTwoFrames(const py::object& vertices) {
  return withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(vertices, "vertices");
    requireRows(rows, num_vertices_, "vertices");
    const Point<S>* points = pointsOf<S>(rows);
    return changeAs<S>(
        [&](auto& mesh) -> MeshUpdate { return mesh.updateTwoFrames(points, num_vertices_); });
  });
}

std::shared_ptr<LockedMesh> LockedMesh::copy() const {
  return query([](const auto& mesh) { return std::make_shared<LockedMesh>(Variant(mesh)); });
}

void LockedMesh::save(std::ostream& out) const {
  query([&](const auto& mesh) { mesh.save(out); });
}

std::shared_ptr<LockedMesh> LockedMesh::load(std::istream& in) {
  std::array<char, 8> magic{};  // the last letter is the type's
  in.read(magic.data(), magic.size());
  in.clear();
  in.seekg(0);
  try {
    const py::gil_scoped_release nogil;
    if (magic.back() == 'f') return std::make_shared<LockedMesh>(DeformableMesh<float>::load(in));
    return std::make_shared<LockedMesh>(DeformableMesh<double>::load(in));
  } catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

py::array LockedMesh::vertices() const {
  return withScalar([&](auto scalar) {
    using S = decltype(scalar);
    return rowsOf<S>(
        queryAs<S>([](const auto& mesh) -> std::vector<Point<S>> { return mesh.vertices(); }));
  });
}

py::array LockedMesh::previousVertices() const {
  return withScalar([&](auto scalar) {
    using S = decltype(scalar);
    return rowsOf<S>(queryAs<S>(
        [](const auto& mesh) -> std::vector<Point<S>> { return mesh.previousVertices(); }));
  });
}

py::array LockedMesh::faces() const {
  static_assert(sizeof(fcl::Triangle) == 3 * sizeof(std::int64_t), "three indices");
  return adopt<std::int64_t>(
      query([](const auto& mesh) { return std::vector<fcl::Triangle>(mesh.triangles()); }),
      {static_cast<py::ssize_t>(num_faces_), 3});
}

void LockedMesh::requireSameType(const LockedMesh& first, const LockedMesh& second) {
  if (first.isDouble() == second.isDouble()) return;
  const auto name_of = [](const LockedMesh& mesh) {
    return std::string(mesh.isDouble() ? "float64" : "float32");
  };
  throw py::type_error("the meshes have different numbers, " + name_of(first) + " and " +
                       name_of(second) + "; give both the same dtype");
}

namespace {

using Class = py::class_<LockedMesh, std::shared_ptr<LockedMesh>>;

void bindUpdates(Class& mesh) {
  mesh.def("update", py::overload_cast<const py::object&>(&LockedMesh::update), py::arg("vertices"),
           docs::kUpdate)
      .def("update", py::overload_cast<const py::object&, const py::object&>(&LockedMesh::update),
           py::arg("indices"), py::arg("vertices"), docs::kUpdateSome)
      .def("update_two_frames", &LockedMesh::updateTwoFrames, py::arg("vertices"),
           docs::kUpdateTwoFrames)
      .def_property_readonly(
          "last_update",
          [](const LockedMesh& self) {
            return self.query([](const auto& m) { return MeshUpdate(m.lastUpdate()); });
          },
          "What the last update did: a MeshUpdate.")
      .def(
          "set_update_threads",
          [](LockedMesh& self, int threads) {
            self.change([&](auto& m) { m.setUpdateThreads(threads); });
          },
          py::arg("threads"), docs::kUpdateThreads)
      .def(
          "set_query_threads",
          [](LockedMesh& self, int threads) {
            self.change([&](auto& m) { m.setQueryThreads(threads); });
          },
          py::arg("threads"), docs::kQueryThreads);
}

[[noreturn]] void raiseForFile(const py::object& path) {
  PyErr_SetFromErrnoWithFilenameObject(PyExc_OSError, path.ptr());
  throw py::error_already_set();
}

void saveToFile(const LockedMesh& mesh, const py::object& path) {
  try {
    writeFile(pathFrom(path), [&](std::ostream& out) { mesh.save(out); });
  } catch (const std::system_error& error) {
    errno = error.code().value();
    raiseForFile(path);
  }
}

std::shared_ptr<LockedMesh> loadFromFile(const py::object& path) {
  const std::string name = pathFrom(path);
  std::ifstream in(name, std::ios::binary);
  if (!in) raiseForFile(path);
  return LockedMesh::load(in);
}

void bindFiles(Class& mesh) {
  mesh.def("save", &saveToFile, py::arg("path"), docs::kSave)
      .def_static("load", &loadFromFile, py::arg("path"), docs::kLoad)
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
          py::arg("memo"));
}

void bindProperties(Class& mesh) {
  mesh.def_property_readonly("vertices", &LockedMesh::vertices,
                             "A copy of the present positions, (N, 3), of the mesh's dtype.")
      .def_property_readonly("previous_vertices", &LockedMesh::previousVertices,
                             "A copy of the positions before the last update, where that was "
                             "update_two_frames, of the mesh's dtype; (0, 3) otherwise.")
      .def_property_readonly("faces", &LockedMesh::faces,
                             "A copy of the vertices of each triangle, (M, 3), int64.")
      .def_property_readonly("num_vertices", &LockedMesh::numVertices, "N: how many vertices.")
      .def_property_readonly("num_faces", &LockedMesh::numFaces, "M: how many triangles.")
      .def_property_readonly(
          "dtype",
          [](const LockedMesh& self) {
            return self.isDouble() ? py::dtype::of<double>() : py::dtype::of<float>();
          },
          "The type of the mesh's numbers: float64 or float32.");
}

void bindMeshUpdate(py::module_& module) {
  py::class_<MeshUpdate>(module, "MeshUpdate", "What an update did.")
      .def_readonly("vertices", &MeshUpdate::vertices, "How many positions were given.")
      .def_readonly("largest_displacement", &MeshUpdate::largest_displacement,
                    "The largest motion of a vertex, rounded up, in the unit of the mesh.")
      .def_readonly("turned", &MeshUpdate::turned,
                    "Whether the boxes lie along other axes since, because the body has turned.")
      .def_readonly("seconds", &MeshUpdate::seconds, "How long it took.")
      .def("__repr__", TextOf({"vertices", "largest_displacement", "turned", "seconds"}));
}

}  // namespace

void bindLockedMesh(py::module_& module) {
  bindMeshUpdate(module);
  Class mesh(module, "DeformableMesh", docs::kDeformableMesh);
  mesh.def(py::init<const py::object&, const py::object&, const py::object&>(), py::arg("vertices"),
           py::arg("faces") = py::none(), py::arg("dtype") = "float64", docs::kDeformableMeshInit)
      .def(
          "validate",
          [](const LockedMesh& self) {
            return self.query([](const auto& m) { return m.validate(); });
          },
          docs::kValidate)
      .def("__repr__", [](const LockedMesh& self) {
        return "<adaptive_bvh.DeformableMesh: " + std::to_string(self.numVertices()) +
               " vertices, " + std::to_string(self.numFaces()) + " faces, " +
               (self.isDouble() ? "float64" : "float32") + ">";
      });
  bindUpdates(mesh);
  bindCopies(mesh);
  bindFiles(mesh);
  bindProperties(mesh);
}

}  // namespace adaptive_bvh::python
