#include "points.h"

#include <array>
#include <limits>

#include "adaptive_bvh/point_query.h"
#include "arrays.h"
#include "locked_mesh.h"
#include "text.h"

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

}  // namespace docs

namespace {

struct OnePoint : Bound {
  std::array<double, 3> point;
  double distance;
  int triangle;
};

struct ManyPoints : Bound {
  py::array_t<double> points, distances;
  py::array_t<std::int32_t> triangles;
};

/// Python's ClosestFeatures.
struct ManyFeatures : Bound {
  py::array_t<double> points, distances, barycentric, normals;
  py::array_t<std::int32_t> triangles, numbers;
  py::array features;  ///< of strings
};

OnePoint closestPointOf(const LockedMesh& mesh, const py::object& point) {
  OnePoint answer{};
  mesh.withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const auto asked = pointFrom<S>(point, "point");
    mesh.queryAs<S>([&](const auto& m) {
      const ClosestPoint<S> closest = closestPoint(m, asked);
      for (int k = 0; k < 3; ++k) answer.point[std::size_t(k)] = double(closest.point[k]);
      answer.distance = double(closest.distance);
      answer.triangle = closest.triangle;
    });
  });
  return answer;
}

ManyPoints closestPointsOf(const LockedMesh& mesh, const py::object& points) {
  std::vector<double> nearest, distances;
  std::vector<int> triangles;
  mesh.withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(points, "points");
    const auto count = static_cast<std::size_t>(rows.shape(0));
    const auto* asked = pointsOf<S>(rows);
    mesh.queryAs<S>([&](const auto& m) {
      std::vector<ClosestPoint<S>> result;
      closestPoints(m, asked, count, result);
      nearest.reserve(3 * count);
      distances.reserve(count);
      triangles.reserve(count);
      for (const ClosestPoint<S>& closest : result) {
        for (int k = 0; k < 3; ++k) nearest.push_back(double(closest.point[k]));
        distances.push_back(double(closest.distance));
        triangles.push_back(closest.triangle);
      }
    });
  });
  const auto count = static_cast<py::ssize_t>(distances.size());
  ManyPoints arrays;
  arrays.points = adopt<double>(std::move(nearest), {count, 3});
  arrays.distances = adopt<double>(std::move(distances), {count});
  arrays.triangles = adopt<std::int32_t>(std::move(triangles), {count});
  return arrays;
}

/// numberOf(element) of each element; and vectorOf(element), three numbers each.
template <typename T, typename Element, typename NumberOf>
py::array_t<T> column(const std::vector<Element>& elements, const NumberOf& numberOf) {
  const auto count = static_cast<py::ssize_t>(elements.size());
  std::vector<T> numbers;
  numbers.reserve(elements.size());
  for (const Element& element : elements) numbers.push_back(static_cast<T>(numberOf(element)));
  return adopt<T>(std::move(numbers), {count});
}
template <typename Element, typename VectorOf>
py::array_t<double> vectors(const std::vector<Element>& elements, const VectorOf& vectorOf) {
  const auto count = static_cast<py::ssize_t>(elements.size());
  std::vector<Eigen::Vector3d> rows;
  rows.reserve(elements.size());
  for (const Element& element : elements) rows.push_back(vectorOf(element).template cast<double>());
  return adopt<double>(std::move(rows), {count, 3});
}

template <typename S>
ManyFeatures arraysOf(const std::vector<ClosestFeature<S>>& found) {
  using F = ClosestFeature<S>;
  ManyFeatures arrays;
  arrays.points = vectors(found, [](const F& f) { return f.point; });
  arrays.distances = column<double>(found, [](const F& f) { return f.distance; });
  arrays.triangles = column<std::int32_t>(found, [](const F& f) { return f.triangle; });
  arrays.barycentric = vectors(found, [](const F& f) { return f.barycentric; });
  arrays.normals = vectors(found, [](const F& f) { return f.normal; });
  arrays.numbers = column<std::int32_t>(
      found, [](const F& f) { return f.triangle < 0 ? -1 : static_cast<int>(f.number); });
  static_assert(int(SurfaceFeature::Face) == 0 && int(SurfaceFeature::Edge) == 1 &&
                    int(SurfaceFeature::Vertex) == 2,
                "the order of the names");
  const py::object names =
      py::module_::import("numpy").attr("array")(py::make_tuple("face", "edge", "vertex", "none"));
  arrays.features = names[column<std::int32_t>(
      found, [](const F& f) { return f.triangle < 0 ? 3 : static_cast<int>(f.feature); })];
  return arrays;
}

ManyFeatures closestFeaturesOf(const LockedMesh& mesh, const py::object& points, double limit) {
  return mesh.withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(points, "points");
    const auto count = static_cast<std::size_t>(rows.shape(0));
    const auto* asked = pointsOf<S>(rows);
    std::vector<ClosestFeature<S>> found;
    mesh.queryAs<S>(
        [&](const auto& m) { closestFeatures(m, asked, count, static_cast<S>(limit), found); });
    return arraysOf(found);
  });
}

void bindPointResults(py::module_& module) {
  py::class_<OnePoint>(module, "ClosestPoint", "The point of a surface that is nearest to a point.")
      .def_property_readonly(
          "point", [](const OnePoint& self) { return py::array_t<double>(3, self.point.data()); },
          "On the surface, (3,) float64.")
      .def_readonly("distance", &OnePoint::distance, "A length.")
      .def_readonly("triangle", &OnePoint::triangle, "That has the point.")
      .def("__repr__", TextOf({"point", "distance", "triangle"}));
  py::class_<ManyPoints>(module, "ClosestPoints", "Of N points, in their order. len() is N.")
      .def_readonly("points", &ManyPoints::points, "On the surface, (N, 3) float64.")
      .def_readonly("distances", &ManyPoints::distances, "(N,) float64, lengths.")
      .def_readonly("triangles", &ManyPoints::triangles, "(N,) int32: the triangles of the points.")
      .def("__len__", [](const ManyPoints& self) { return self.distances.shape(0); })
      .def("__repr__", TextOf({"points", "distances", "triangles"}));
}

void bindFeatureResults(py::module_& module) {
  using F = ManyFeatures;
  py::class_<F>(module, "ClosestFeatures",
                "Of N points, in their order, the nearest points of a surface. len() is N.")
      .def_readonly("points", &F::points,
                    "On the surface, (N, 3) float64; NaN where none is within the limit.")
      .def_readonly("distances", &F::distances,
                    "(N,) float64, lengths; infinite where none is within the limit.")
      .def_readonly("triangles", &F::triangles,
                    "(N,) int32: the triangles of the points; -1 where there is none.")
      .def_readonly("barycentric", &F::barycentric,
                    "(N, 3) float64: of the points, for the triangles' corners.")
      .def_readonly("features", &F::features,
                    "(N,) of 'face', 'edge', 'vertex', or 'none' where none is within the limit: "
                    "what the points lie on.")
      .def_readonly("numbers", &F::numbers,
                    "(N,) int32: of the triangle, the edge (as in FeaturePairs) or the vertex; -1 "
                    "where there is none.")
      .def_readonly("normals", &F::normals,
                    "(N, 3) float64, of length 1: the outward direction; on an edge the mean of "
                    "its triangles, on a vertex their mean weighted by their angles.")
      .def("__len__", [](const F& self) { return self.distances.shape(0); })
      .def("__repr__", TextOf({"points", "distances", "triangles", "barycentric", "features",
                               "numbers", "normals"}));
}

}  // namespace

void bindPoints(py::module_& module) {
  bindPointResults(module);
  bindFeatureResults(module);
  module.def("closest_point", &closestPointOf, py::arg("mesh"), py::arg("point"),
             "The nearest point of the mesh's surface to `point`, (3,), in the mesh's own frame.");
  module.def("closest_points", &closestPointsOf, py::arg("mesh"), py::arg("points"),
             docs::kClosestPoints);
  module.def("closest_features", &closestFeaturesOf, py::arg("mesh"), py::arg("points"),
             py::arg("limit") = std::numeric_limits<double>::infinity(), docs::kClosestFeatures);
}

}  // namespace adaptive_bvh::python
