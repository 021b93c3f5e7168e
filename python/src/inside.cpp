#include "adaptive_bvh/point_query.h"
#include "arrays.h"
#include "bind.h"
#include "locked_mesh.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kSignedDistances =
    R"(The distances of points to the mesh's surface, negative inside (trimesh's `signed_distance` is
positive there).

points: (N, 3), in the mesh's own frame. Returns (N,) float64. Raises ValueError when the mesh is not
closed; the message names an edge.)";

constexpr const char* kWindingNumbers =
    R"(How often the triangles wind around points: 0 outside and 1 inside of a closed mesh; of open
meshes and soups the generalised winding number. Off by at most `tolerance`.

points: (N, 3), in the mesh's own frame. Returns (N,) float64.)";
}  // namespace docs

namespace {

py::array_t<double> signedDistancesOf(const LockedMesh& mesh, const py::object& points) {
  const Rows rows(points, "points");
  std::vector<double> result;
  mesh.query([&](const Mesh& m) { signedDistances(m, rows.begin(), rows.size(), result); });
  return adopt(std::move(result));
}

py::array_t<double> windingNumbersOf(const LockedMesh& mesh, const py::object& points,
                                     double tolerance) {
  const Rows rows(points, "points");
  std::vector<double> result;
  mesh.query(
      [&](const Mesh& m) { windingNumbers(m, rows.begin(), rows.size(), tolerance, result); });
  return adopt(std::move(result));
}

py::array openEdgesOf(const LockedMesh& mesh) {
  std::vector<OpenEdge> open;
  mesh.query([&](const Mesh& m) { isWatertight(m, &open); });
  std::vector<std::array<int, 4>> rows;
  for (const OpenEdge& edge : open)
    rows.push_back({int(edge.from), int(edge.to), int(edge.triangle), edge.surplus});
  return adopt(std::move(rows));
}

}  // namespace

void bindInside(py::module_& module) {
  module.def("signed_distances", &signedDistancesOf, py::arg("mesh"), py::arg("points"),
             docs::kSignedDistances);
  module.def("winding_numbers", &windingNumbersOf, py::arg("mesh"), py::arg("points"),
             py::arg("tolerance") = 0.1, docs::kWindingNumbers);
  module.def(
      "is_watertight",
      [](const LockedMesh& mesh) {
        return mesh.query([](const Mesh& m) { return isWatertight(m); });
      },
      py::arg("mesh"),
      "Whether a mesh encloses something: every edge is run through as often in one direction as "
      "in the other by the triangles that share it. Vertices are compared by index "
      "(weld_vertices).");
  module.def(
      "open_edges", &openEdgesOf, py::arg("mesh"),
      "The edges for which a mesh is not watertight, (K, 4) int32, by increasing triangle: the "
      "vertices where an edge begins and ends, its triangle with the smallest index, and how much "
      "more often triangles run through it in this direction, 1 on a boundary.");
}

}  // namespace adaptive_bvh::python
