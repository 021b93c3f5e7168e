#include "meshes.h"

#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/shape_mesh.h"
#include "arrays.h"
#include "bind.h"
#include "results.h"
#include "shapes.h"

namespace adaptive_bvh::python {
namespace {

constexpr const char* kLoadMesh =
    R"(Reads a triangle mesh: OBJ, STL, PLY, OFF, DAE (Collada), glTF and what else assimp reads.

path: a string, bytes or a path object.
weld: makes vertices of equal position one, which most formats repeat for every face.
weld_tolerance: positions no farther apart count as equal, in the unit of the result.
up: 'x', 'y' or 'z' turns the mesh until the axis that its file declares as up (Collada, glTF) is
this one; None keeps the axes of the file.
metres: multiplies by the unit that the file declares (Collada, 3MF, AMF, FBX).
unit, undeclared_unit: with metres, the unit of the result, and that of files that declare none, both
in metres.
scale: multiplies all positions, after the unit.
buffers_outside_folder: glTF buffers may be any files; False reads only those in the folder of the
document or below it.
Returns a Mesh. Raises MeshLoadError, a ValueError, when the file cannot be used; ValueError when an
option is out of range.)";

constexpr const char* kWeldVertices =
    R"(Makes vertices of equal position one, and renumbers the faces.

vertices: (N, 3). faces: (M, 3) integers. tolerance: a vertex no farther than this from one that was
kept becomes the first such vertex, and faces of which two corners become one are removed. Returns a
Mesh. Neighbours that share vertices make a mesh cheaper to query, and self_collide leaves them out.
ValueError when the tolerance is negative or NaN.)";

constexpr const char* kShapeMesh =
    R"(The surface of a shape as a closed Mesh, in the shape's frame.

turn: edges around a full turn of what is round; rounded up to a power of two, from 8 to 1024. A Plane
and a Halfspace give a square with sides of 2. ValueError when turn is not in 1 to 1024.)";

using Arrays = TriangleMesh;  // Python's Mesh

Arrays weldOf(const py::object& vertices, const py::object& faces, double tolerance) {
  Arrays mesh = meshFrom(vertices, faces);
  const py::gil_scoped_release nogil;
  weldVertices(mesh, tolerance);
  return mesh;
}

Arrays shapeMeshOf(const Shape& shape, int turn) { return shapeMesh(shape.geometry(), turn); }

UpAxis upAxisFrom(const std::optional<std::string>& name) {
  if (!name) return UpAxis::AsInFile;
  if (*name == "x") return UpAxis::X;
  if (*name == "y") return UpAxis::Y;
  if (*name == "z") return UpAxis::Z;
  throw py::value_error("up must be 'x', 'y', 'z' or None, not '" + *name + "'");
}

Arrays loadOf(const py::object& path, bool weld, double weld_tolerance,
              const std::optional<std::string>& up, bool metres, double unit,
              double undeclared_unit, double scale, bool buffers_outside_folder) {
  const std::string name = pathFrom(path);
  MeshLoadOptions options;
  options.weld = weld;
  options.weld_tolerance = weld_tolerance;
  options.up = upAxisFrom(up);
  options.metres = metres;
  options.unit = unit;
  options.undeclared_unit = undeclared_unit;
  options.scale = scale;
  options.buffers_outside_folder = buffers_outside_folder;
#ifdef ADAPTIVE_BVH_PYTHON_MESH_IO
  const py::gil_scoped_release nogil;
  return loadMesh(name, options);
#else
  throw std::runtime_error("cannot read " + name + ": adaptive_bvh was built without assimp");
#endif
}

}  // namespace

std::string pathFrom(const py::object& path) {
  PyObject* bytes = nullptr;
  if (!PyUnicode_FSConverter(path.ptr(), &bytes)) throw py::error_already_set();
  return std::string(py::reinterpret_steal<py::bytes>(bytes));
}

TriangleMesh meshFrom(const py::object& vertices, const py::object& faces) {
  const Rows rows(vertices, "vertices");
  TriangleMesh mesh;
  mesh.vertices.assign(rows.begin(), rows.end());
  mesh.triangles = trianglesFrom(faces, rows.size());
  return mesh;
}

void bindMeshes(py::module_& module) {
  py::register_local_exception<MeshLoadError>(module, "MeshLoadError", PyExc_ValueError);
  module.attr("MeshLoadError").attr("__doc__") =
      "A file could not be used. Names the path and the reason.";
  ResultClass<Arrays>(module, "Mesh",
                      "Positions, and triangles that index them. Pass it to DeformableMesh.")
      .attribute("vertices", &Arrays::vertices, "(N, 3) float64.")
      .attribute("faces", &Arrays::triangles, "(M, 3) int64, counter-clockwise seen from outside.");
  module.def("load_mesh", &loadOf, "path"_a, py::kw_only(), "weld"_a = true,
             "weld_tolerance"_a = 0., "up"_a = py::none(), "metres"_a = true, "unit"_a = 1.,
             "undeclared_unit"_a = 1., "scale"_a = 1., "buffers_outside_folder"_a = false,
             kLoadMesh);
  module.def("shape_mesh", &shapeMeshOf, "shape"_a, "turn"_a = 64, kShapeMesh);
  module.def("weld_vertices", &weldOf, "vertices"_a, "faces"_a, "tolerance"_a = 0., kWeldVertices);
}

}  // namespace adaptive_bvh::python
