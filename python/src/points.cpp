#include "points.h"

#include <array>
#include <limits>

#include "adaptive_bvh/point_query.h"
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

constexpr const char* kFirstHit =
    R"(Of each of many rays the first triangle that it meets.

origins, directions: (N, 3), or (3,) for one ray, in the mesh's own frame; directions of any length
    but 0. Many rays in one call are faster than one by one.
begin, end: hits count where begin <= t <= end. ValueError when begin is negative or end is less.
Returns RayHits with N entries: t is infinite and the triangle -1 where a ray meets nothing.)";

constexpr const char* kAnyHit =
    R"(Of each of many rays whether it meets a triangle (occlusion): (N,) bool. Faster than first_hit.

origins, directions, begin, end: as of first_hit. The segment from a point to another is the ray
along their difference from 0 to 1.)";

constexpr const char* kRayHits =
    R"(All triangles that rays meet: of each ray by increasing t.

origins, directions, begin, end: as of first_hit. Sides and corners belong to each triangle that has
    them: no ray slips between two.
Returns RayHits; `rays` says which ray.)";
}  // namespace docs

namespace {

/// One ray becomes a list of one.
py::object listed(const py::object& rows, const char* name) {
  py::array array = numbersFrom(rows, name);
  return array.ndim() == 1 ? py::object(array.reshape({py::ssize_t(1), py::ssize_t(-1)}))
                           : py::object(array);
}

}  // namespace

template <typename S>
Rays<S>::Rays(const py::object& from, const py::object& along)
    : origins(rowsFrom<S>(listed(from, "origins"), "origins")),
      directions(rowsFrom<S>(listed(along, "directions"), "directions")) {
  if (origins.shape(0) != directions.shape(0))
    throw py::value_error("there are " + std::to_string(origins.shape(0)) + " origins and " +
                          std::to_string(directions.shape(0)) + " directions");
}
template struct Rays<double>;
template struct Rays<float>;

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

struct ManyHits : Bound {
  py::array_t<std::int32_t> rays, triangles;
  py::array_t<double> t, u, v;
};

/// Hits side by side, before they become arrays.
struct HitLists {
  std::vector<int> rays, triangles;
  std::vector<double> t, u, v;

  template <typename S>
  void add(int ray, const RayHit<S>& hit) {
    rays.push_back(ray);
    triangles.push_back(hit.triangle);
    t.push_back(double(hit.t));
    u.push_back(double(hit.u));
    v.push_back(double(hit.v));
  }

  ManyHits arrays() && {
    const auto count = static_cast<py::ssize_t>(rays.size());
    ManyHits hits;
    hits.rays = adopt<std::int32_t>(std::move(rays), {count});
    hits.triangles = adopt<std::int32_t>(std::move(triangles), {count});
    hits.t = adopt<double>(std::move(t), {count});
    hits.u = adopt<double>(std::move(u), {count});
    hits.v = adopt<double>(std::move(v), {count});
    return hits;
  }
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

/// From `begin` to `end`, as S.
template <typename S>
RayRange<S> rangeOf(double begin, double end) {
  return {static_cast<S>(begin), static_cast<S>(end)};
}

/// Runs query(mesh, origins, directions, count, range).
template <typename Query>
void queryRays(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
               double begin, double end, const Query& query) {
  mesh.withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rays<S> rays(origins, directions);
    const std::size_t count = rays.size();
    const auto *from = pointsOf<S>(rays.origins), *along = pointsOf<S>(rays.directions);
    mesh.queryAs<S>([&](const auto& m) { query(m, from, along, count, rangeOf<S>(begin, end)); });
  });
}

ManyHits firstHitOf(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
                    double begin, double end) {
  HitLists lists;
  queryRays(mesh, origins, directions, begin, end,
            [&](const auto& m, auto* from, auto* along, std::size_t count, const auto& range) {
              std::vector<RayHit<ScalarOf<decltype(m)>>> result;
              firstHits(m, from, along, count, range, result);
              for (std::size_t i = 0; i < count; ++i) lists.add(int(i), result[i]);
            });
  return std::move(lists).arrays();
}

py::array_t<bool> anyHitOf(const LockedMesh& mesh, const py::object& origins,
                           const py::object& directions, double begin, double end) {
  std::vector<std::uint8_t> result;
  queryRays(mesh, origins, directions, begin, end,
            [&](const auto& m, auto* from, auto* along, std::size_t count, const auto& range) {
              anyHits(m, from, along, count, range, result);
            });
  const auto count = static_cast<py::ssize_t>(result.size());
  return adopt<bool>(std::move(result), {count});
}

ManyHits rayHitsOf(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
                   double begin, double end) {
  HitLists lists;
  queryRays(mesh, origins, directions, begin, end,
            [&](const auto& m, auto* from, auto* along, std::size_t count, const auto& range) {
              std::vector<RayHit<ScalarOf<decltype(m)>>> result;
              for (std::size_t i = 0; i < count; ++i) {
                rayHits(m, from[i], along[i], range, result);
                for (const auto& hit : result) lists.add(int(i), hit);
              }
            });
  return std::move(lists).arrays();
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
      .def_readonly("triangles", &ManyPoints::triangles, "(N,) int32: those that have the points.")
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
                    "(N,) int32: those that have the points; -1 where there is none.")
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

void bindHitResults(py::module_& module) {
  py::class_<ManyHits>(module, "RayHits",
                       "Where rays meet triangles, in arrays side by side. len() counts the hits.")
      .def_readonly("rays", &ManyHits::rays, "(K,) int32: which of the rays.")
      .def_readonly("triangles", &ManyHits::triangles,
                    "(K,) int32: which triangle; -1 where a ray of first_hit meets nothing.")
      .def_readonly("t", &ManyHits::t,
                    "(K,) float64: the point is at origin + t * direction; infinite where a ray of "
                    "first_hit meets nothing.")
      .def_readonly(
          "u", &ManyHits::u,
          "(K,) float64: the point is (1 - u - v) a + u b + v c of the triangle's corners.")
      .def_readonly("v", &ManyHits::v, "(K,) float64, as u.")
      .def("__len__", [](const ManyHits& self) { return self.t.shape(0); })
      .def("__repr__", TextOf({"rays", "triangles", "t", "u", "v"}));
}

void bindRays(py::module_& module) {
  const auto define = [&](const char* name, auto function, const char* doc) {
    module.def(name, function, py::arg("mesh"), py::arg("origins"), py::arg("directions"),
               py::kw_only(), py::arg("begin") = 0.0,
               py::arg("end") = std::numeric_limits<double>::infinity(), doc);
  };
  define("first_hit", &firstHitOf, docs::kFirstHit);
  define("any_hit", &anyHitOf, docs::kAnyHit);
  define("ray_hits", &rayHitsOf, docs::kRayHits);
}

}  // namespace

void bindPoints(py::module_& module) {
  bindPointResults(module);
  bindFeatureResults(module);
  bindHitResults(module);
  module.def("closest_point", &closestPointOf, py::arg("mesh"), py::arg("point"),
             "The nearest point of the mesh's surface to `point`, (3,), in the mesh's own frame.");
  module.def("closest_points", &closestPointsOf, py::arg("mesh"), py::arg("points"),
             docs::kClosestPoints);
  module.def("closest_features", &closestFeaturesOf, py::arg("mesh"), py::arg("points"),
             py::arg("limit") = std::numeric_limits<double>::infinity(), docs::kClosestFeatures);
  bindRays(module);
}

}  // namespace adaptive_bvh::python
