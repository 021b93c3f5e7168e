#include "inside.h"

#include "adaptive_bvh/point_query.h"
#include "arrays.h"
#include "locked_mesh.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kSignedDistances =
    R"(The distances of points to the mesh's surface, negative inside (trimesh's `signed_distance` is
positive there).

points: (N, 3), in the mesh's own frame. Returns (N,) float64. Raises ValueError when the mesh is not
closed; the message names an edge.)";

constexpr const char* kWindingNumbers =
    R"(How often the triangles wind around points: 0 outside and 1 inside of a closed mesh; of open
meshes and soups the generalised winding number, to 1e-12, or to 2^-52 for each boundary edge where
there are more than 4,000. Takes time in proportion to the boundary edges.

points: (N, 3), in the mesh's own frame. Returns (N,) float64.)";
}  // namespace docs

namespace {

using Doubles = py::array_t<double>;

/// Calls query(mesh, points, count, result) and returns a number for each point.
template <typename Query>
Doubles numberOfEach(const LockedMesh& mesh, const py::object& points, const Query& query) {
  Doubles numbers;
  mesh.withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(points, "points");
    const auto count = static_cast<std::size_t>(rows.shape(0));
    const auto* asked = pointsOf<S>(rows);
    std::vector<S> result;
    mesh.queryAs<S>([&](const auto& m) { query(m, asked, count, result); });
    numbers = adoptDoubles<S>(std::move(result), {static_cast<py::ssize_t>(count)});
  });
  return numbers;
}

void bindWatertight(py::module_& module) {
  module.def(
      "is_watertight",
      [](const LockedMesh& mesh) {
        bool is_closed = false;
        mesh.query([&](const auto& m) { is_closed = isWatertight(m); });
        return is_closed;
      },
      py::arg("mesh"),
      "Whether a mesh encloses something: every edge is run through as often in one direction as "
      "in the other by the triangles that share it. Vertices are compared by index "
      "(weld_vertices).");
  module.def(
      "open_edges",
      [](const LockedMesh& mesh) {
        std::vector<OpenEdge> open;
        mesh.query([&](const auto& m) { isWatertight(m, &open); });
        std::vector<std::int32_t> rows;
        for (const OpenEdge& edge : open)
          rows.insert(rows.end(), {int(edge.from), int(edge.to), int(edge.triangle), edge.surplus});
        return adopt<std::int32_t>(std::move(rows), {static_cast<py::ssize_t>(open.size()), 4});
      },
      py::arg("mesh"),
      "The edges for which a mesh is not watertight, (K, 4) int32, by increasing triangle: the "
      "vertices where an edge begins and ends, its triangle with the smallest index, and how much "
      "more often triangles run through it in this direction, 1 on a boundary.");
}

}  // namespace

void bindInside(py::module_& module) {
  module.def(
      "signed_distances",
      [](const LockedMesh& mesh, const py::object& points) {
        return numberOfEach(mesh, points, [](const auto& m, auto* asked, auto count, auto& result) {
          signedDistances(m, asked, count, result);
        });
      },
      py::arg("mesh"), py::arg("points"), docs::kSignedDistances);
  module.def(
      "winding_numbers",
      [](const LockedMesh& mesh, const py::object& points) {
        return numberOfEach(mesh, points,
                            [&](const auto& m, auto* asked, auto count, auto& result) {
                              windingNumbers(m, asked, count, result);
                            });
      },
      py::arg("mesh"), py::arg("points"), docs::kWindingNumbers);
  bindWatertight(module);
}

}  // namespace adaptive_bvh::python
