#include <limits>

#include "adaptive_bvh/point_query.h"
#include "arrays.h"
#include "bind.h"
#include "locked_mesh.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kClosestPoints =
    R"(Of each of many points the nearest point of the mesh's surface. Points that follow each other
are best near each other.

points: (N, 3), in the mesh's own frame. Returns ClosestPoints.)";

constexpr const char* kClosestFeatures =
    R"(Of each of many points the nearest point of the mesh's surface, what it lies on, and the normal
there.

points: (N, 3), in the mesh's own frame.
limit: a length, 0 or more; points of the surface that are farther away are left out. ValueError when
    it is negative or NaN.
Returns ClosestFeatures.)";

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

/// Python's ClosestPoints.
struct ManyPoints : Bound {
  std::vector<fcl::Vector3d> points;
  std::vector<double> distances;
  std::vector<int> triangles;
};

/// Python's ClosestFeatures.
struct ManyFeatures : Bound {
  std::vector<fcl::Vector3d> points, barycentric, normals;
  std::vector<double> distances;
  std::vector<int> triangles, numbers;
  py::object features;  ///< an array of strings
};

ClosestPoint closestPointOf(const LockedMesh& mesh, const py::object& point) {
  const fcl::Vector3d asked = pointFrom(point, "point");
  return mesh.query([&](const Mesh& m) { return closestPoint(m, asked); });
}

ManyPoints closestPointsOf(const LockedMesh& mesh, const py::object& points) {
  const Rows rows(points, "points");
  return mesh.query([&](const Mesh& m) {
    using P = ClosestPoint;
    std::vector<P> found;
    closestPoints(m, rows.begin(), rows.size(), found);
    return ManyPoints{
        {}, column(found, &P::point), column(found, &P::distance), column(found, &P::triangle)};
  });
}

/// The names of the features, by way of NumPy.
py::object namesOf(const std::vector<ClosestFeature>& found) {
  static_assert(int(SurfaceFeature::Face) == 0 && int(SurfaceFeature::Edge) == 1 &&
                    int(SurfaceFeature::Vertex) == 2,
                "the order of the names");
  std::vector<int> kinds;
  for (const auto& f : found) kinds.push_back(f.triangle < 0 ? 3 : static_cast<int>(f.feature));
  const py::object names =
      py::module_::import("numpy").attr("array")(py::make_tuple("face", "edge", "vertex", "none"));
  return names[adopt(std::move(kinds))];
}

ManyFeatures closestFeaturesOf(const LockedMesh& mesh, const py::object& points, double limit) {
  using F = ClosestFeature;
  const Rows rows(points, "points");
  const auto found = find<std::vector<F>>(mesh, [&](auto& features, const Mesh& m) {
    closestFeatures(m, rows.begin(), rows.size(), limit, features);
  });
  ManyFeatures result;
  result.points = column(found, &F::point);
  result.distances = column(found, &F::distance);
  result.triangles = column(found, &F::triangle);
  result.barycentric = column(found, &F::barycentric);
  result.normals = column(found, &F::normal);
  for (const F& f : found)
    result.numbers.push_back(f.triangle < 0 ? -1 : static_cast<int>(f.number));
  result.features = namesOf(found);
  return result;
}

/// A number for each point, of `query(mesh, points, count, numbers)`.
template <typename Query>
auto ofEachPoint(const Query& query) {
  return [query](const LockedMesh& mesh, const py::object& points) {
    const Rows rows(points, "points");
    return adopt(find<std::vector<double>>(
        mesh, [&](auto& numbers, const Mesh& m) { query(m, rows.begin(), rows.size(), numbers); }));
  };
}

py::array openEdgesOf(const LockedMesh& mesh) {
  const auto open = find<std::vector<OpenEdge>>(
      mesh, [](auto& edges, const Mesh& m) { isWatertight(m, &edges); });
  std::vector<std::array<int, 4>> rows;
  for (const OpenEdge& edge : open)
    rows.push_back({int(edge.from), int(edge.to), int(edge.triangle), edge.surplus});
  return adopt(std::move(rows));
}

void bindPointResults(py::module_& module) {
  using P = ClosestPoint;
  ResultClass<P>(module, "ClosestPoint", "The point of a surface that is nearest to a point.")
      .attribute("point", &P::point, "On the surface, (3,) float64.")
      .attribute("distance", &P::distance, "A length.")
      .attribute("triangle", &P::triangle, "That has the point.");
  using M = ManyPoints;
  ResultClass<M>(module, "ClosestPoints", "Of N points, in their order. len() is N.")
      .attribute("points", &M::points, "On the surface, (N, 3) float64.")
      .attribute("distances", &M::distances, "(N,) float64, lengths.")
      .attribute("triangles", &M::triangles, "(N,) int32: the triangles of the points.")
      .length(&M::distances);
}

void bindFeatureResults(py::module_& module) {
  using F = ManyFeatures;
  ResultClass<F>(module, "ClosestFeatures",
                 "Of N points, in their order, the nearest points of a surface. len() is N.")
      .attribute("points", &F::points,
                 "On the surface, (N, 3) float64; NaN where none is within the limit.")
      .attribute("distances", &F::distances,
                 "(N,) float64, lengths; infinite where none is within the limit.")
      .attribute("triangles", &F::triangles,
                 "(N,) int32: the triangles of the points; -1 where there is none.")
      .attribute("barycentric", &F::barycentric,
                 "(N, 3) float64: of the points, for the triangles' corners.")
      .attribute("features", &F::features,
                 "(N,) of 'face', 'edge', 'vertex', or 'none' where none is within the limit: what "
                 "the points lie on.")
      .attribute("numbers", &F::numbers,
                 "(N,) int32: of the triangle, the edge (as in FeaturePairs) or the vertex; -1 "
                 "where there is none.")
      .attribute("normals", &F::normals,
                 "(N, 3) float64, of length 1: the outward direction; on an edge the mean of its "
                 "triangles, on a vertex their mean weighted by their angles.")
      .length(&F::distances);
}

}  // namespace

void bindPoints(py::module_& module) {
  bindPointResults(module);
  bindFeatureResults(module);
  module.def("closest_point", &closestPointOf, "mesh"_a, "point"_a,
             "The nearest point of the mesh's surface to `point`, (3,), in the mesh's own frame.");
  module.def("closest_points", &closestPointsOf, "mesh"_a, "points"_a, docs::kClosestPoints);
  module.def("closest_features", &closestFeaturesOf, "mesh"_a, "points"_a,
             "limit"_a = std::numeric_limits<double>::infinity(), docs::kClosestFeatures);
}

void bindInside(py::module_& module) {
  module.def("signed_distances", ofEachPoint([](auto&&... a) { signedDistances(a...); }), "mesh"_a,
             "points"_a, docs::kSignedDistances);
  module.def("winding_numbers", ofEachPoint([](auto&&... a) { windingNumbers(a...); }), "mesh"_a,
             "points"_a, docs::kWindingNumbers);
  module.def(
      "is_watertight",
      [](const LockedMesh& mesh) {
        return mesh.query([](const Mesh& m) { return isWatertight(m); });
      },
      "mesh"_a,
      "Whether a mesh encloses something: every edge is run through as often in one direction as "
      "in the other by the triangles that share it. Vertices are compared by index "
      "(weld_vertices).");
  module.def(
      "open_edges", &openEdgesOf, "mesh"_a,
      "The edges for which a mesh is not watertight, (K, 4) int32, by increasing triangle: the "
      "vertices where an edge begins and ends, its triangle with the smallest index, and how much "
      "more often triangles run through it in this direction, 1 on a boundary.");
}

}  // namespace adaptive_bvh::python
