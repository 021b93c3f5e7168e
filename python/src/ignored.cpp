// What queries leave out: Ignored and SurfaceNeighbourhood.
#include "ignored.h"

#include <algorithm>
#include <limits>

#include "arrays.h"
#include "bind.h"
#include "locked_mesh.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kIgnored =
    R"(What a query leaves out.

pairs: (K, 2) integers in any order, of triangles; or FeaturePairs, of a query of features; or None.
surface: of one mesh: a SurfaceNeighbourhood of this mesh, or None. A vertex or an edge counts as its
    triangle with the smallest index.
neighbours: of one mesh: which neighbouring triangles are left out: those with a 'shared vertex',
    those with a 'shared edge' (two vertices in common), or 'none'. With 'beyond shared', which is
    for self_collide, neighbours count where they have points in common beside the shared vertex or
    edge: where they are folded over each other or cross, which is decided exactly. Vertices are
    compared by index: see weld_vertices.)";

constexpr const char* kNeighbourhood =
    R"(Pairs of triangles of one mesh that do not count. Triangles with a common vertex are among
them. For this mesh and its copies, at all positions.)";

constexpr const char* kByDistance =
    R"(The triangles at most `distance` away along the surface: by the shortest path along edges, at
the present positions.)";

constexpr const char* kByLabels =
    R"(By a label for each triangle, (num_faces,) integers from 0 on: 'between' lets pairs count whose
labels differ, 'within' those whose labels are equal.)";
}  // namespace docs

namespace {

NeighbourFilter neighbourFilter(const std::string& name) {
  return named<NeighbourFilter>(name, "neighbours",
                                {{"shared vertex", NeighbourFilter::SharedVertex},
                                 {"shared edge", NeighbourFilter::SharedEdge},
                                 {"beyond shared", NeighbourFilter::BeyondShared},
                                 {"none", NeighbourFilter::None}});
}

LabelRule labelRule(const std::string& name) {
  return named<LabelRule>(name, "label_rule",
                          {{"within", LabelRule::Within}, {"between", LabelRule::Between}});
}

void sort(std::vector<FeaturePair>& pairs, bool is_self) {
  for (FeaturePair& pair : pairs)
    if (is_self && pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end());
}

PyIgnored ignoredOf(const py::object& pairs, const Neighbours* surface, const std::string& name) {
  PyIgnored ignored;
  ignored.pairs = pairs;
  if (surface) ignored.surface = surface->pairs;
  ignored.neighbours = neighbourFilter(name);
  return ignored;
}

std::vector<unsigned> labelsFrom(const py::object& labels, const LockedMesh& mesh) {
  auto numbers = indicesFrom(labels, std::size_t(1) << 32, "labels", "labels from 0 on");
  if (numbers.size() != mesh.numFaces())
    throw py::value_error("labels has " + std::to_string(numbers.size()) +
                          " numbers; one for each of " + std::to_string(mesh.numFaces()) +
                          " faces is needed");
  return numbers;
}

/// Makes a SurfaceNeighbourhood of a mesh by f(mesh).
template <typename F>
Neighbours neighboursBy(const LockedMesh& mesh, const F& f) {
  return Neighbours(mesh.query([&](const Mesh& m) { return f(m); }));
}

void bindNeighbourhood(py::module_& module) {
  py::class_<Neighbours>(module, "SurfaceNeighbourhood", docs::kNeighbourhood)
      .def(py::init([](const LockedMesh& mesh) {
             return neighboursBy(mesh, [](const Mesh& m) { return SurfaceNeighbourhood(m); });
           }),
           "mesh"_a, "Only triangles with a common vertex.")
      .def_static(
          "by_rings",
          [](const LockedMesh& mesh, unsigned rings) {
            return neighboursBy(
                mesh, [&](const Mesh& m) { return SurfaceNeighbourhood::byRings(m, rings); });
          },
          "mesh"_a, "rings"_a,
          "The triangles within so many steps to a triangle with a common vertex.")
      .def_static(
          "by_distance",
          [](const LockedMesh& mesh, double distance) {
            return neighboursBy(
                mesh, [&](const Mesh& m) { return SurfaceNeighbourhood::byDistance(m, distance); });
          },
          "mesh"_a, "distance"_a, docs::kByDistance)
      .def_static(
          "by_labels",
          [](const LockedMesh& mesh, const py::object& labels, const std::string& label_rule) {
            const LabelRule rule = labelRule(label_rule);
            const std::vector<unsigned> numbers = labelsFrom(labels, mesh);
            return neighboursBy(mesh, [&](const Mesh& m) {
              return SurfaceNeighbourhood::byLabels(m, numbers, rule);
            });
          },
          "mesh"_a, "labels"_a, "label_rule"_a = "between", docs::kByLabels)
      .def(
          "contains",
          [](const Neighbours& self, unsigned first, unsigned second) {
            return self.pairs.contains(first, second);
          },
          "first"_a, "second"_a, "Whether two triangles do not count.");
}

}  // namespace

IgnoredArgument::IgnoredArgument(const py::object& given, Of elements, bool is_self) {
  if (py::isinstance<PyIgnored>(given)) {
    const auto& ignored = given.cast<const PyIgnored&>();
    surface_ = ignored.surface;
    ignored_.neighbours = ignored.neighbours;
    setPairs(ignored.pairs, elements, is_self);
  } else if (py::isinstance<Neighbours>(given)) {
    surface_ = given.cast<const Neighbours&>().pairs;
  } else {
    setPairs(given, elements, is_self);
  }
  if (surface_) ignored_.surface = &*surface_;
}

void IgnoredArgument::setPairs(const py::object& pairs, Of elements, bool is_self) {
  if (pairs.is_none()) return;
  const bool has_features = py::isinstance<FeaturePairs>(pairs);
  if (has_features != (elements == Features))
    throw py::type_error(has_features
                             ? "ignored is FeaturePairs; of triangles (K, 2) integers are needed"
                             : "ignored of features is not FeaturePairs");
  if (!has_features) {
    triangles_ = pairsFrom(pairs, "ignored");
    sort(triangles_, is_self);
    ignored_.triangles.list = &triangles_;
    return;
  }
  features_ = pairs.cast<const FeaturePairs&>();
  sort(features_.vertex_face, false);
  sort(features_.face_vertex, false);
  sort(features_.edge_edge, is_self);
  ignored_.vertex_face.list = &features_.vertex_face;
  ignored_.face_vertex.list = &features_.face_vertex;
  ignored_.edge_edge.list = &features_.edge_edge;
}

void bindIgnored(py::module_& module) {
  bindNeighbourhood(module);
  py::class_<PyIgnored>(module, "Ignored", docs::kIgnored)
      .def(py::init(&ignoredOf), "pairs"_a = py::none(), py::kw_only(), "surface"_a = py::none(),
           "neighbours"_a = "shared vertex");
}

}  // namespace adaptive_bvh::python
