#include "features.h"

namespace adaptive_bvh::python {
namespace {

constexpr const char* kFeaturePairs =
    R"(Pairs of features: where two surfaces come together a vertex of one comes to a face of the other,
or two edges do. len() counts all.

An edge has the number 3 t + k: it goes from corner k of triangle t to corner (k + 1) % 3. Of the
numbers that an edge of several triangles has the smallest counts.)";

py::array_t<std::int32_t> arrayOf(std::vector<FeaturePair>&& pairs) {
  const auto count = static_cast<py::ssize_t>(pairs.size());
  return adopt<std::int32_t>(std::move(pairs), {count, 2});
}

constexpr std::size_t kAny = std::size_t(1) << 31;  // meshes are checked where they are known

py::array_t<std::int32_t> checked(const py::object& pairs, const char* name) {
  if (pairs.is_none()) return arrayOf({});
  return arrayOf(pairsFrom<FeaturePair>(pairs, kAny, kAny, name));
}

}  // namespace

FeatureArrays::FeatureArrays(FeaturePairs&& pairs)
    : vertex_face(arrayOf(std::move(pairs.vertex_face))),
      face_vertex(arrayOf(std::move(pairs.face_vertex))),
      edge_edge(arrayOf(std::move(pairs.edge_edge))) {}

void bindFeatures(py::module_& module) {
  py::class_<FeatureArrays>(module, "FeaturePairs", kFeaturePairs)
      .def(py::init([](const py::object& vertex_face, const py::object& face_vertex,
                       const py::object& edge_edge) {
             FeatureArrays arrays;
             arrays.vertex_face = checked(vertex_face, "vertex_face");
             arrays.face_vertex = checked(face_vertex, "face_vertex");
             arrays.edge_edge = checked(edge_edge, "edge_edge");
             return arrays;
           }),
           py::arg("vertex_face") = py::none(), py::arg("face_vertex") = py::none(),
           py::arg("edge_edge") = py::none(), "Each an array (K, 2) of integers, or None.")
      .def_readonly("vertex_face", &FeatureArrays::vertex_face,
                    "(K, 2) int32: a vertex of the first mesh and a triangle of the second.")
      .def_readonly("face_vertex", &FeatureArrays::face_vertex,
                    "(K, 2) int32: a triangle of the first mesh and a vertex of the second. Empty "
                    "for one mesh with itself.")
      .def_readonly("edge_edge", &FeatureArrays::edge_edge,
                    "(K, 2) int32: an edge of the first mesh and one of the second; of one mesh "
                    "with itself the smaller number first.")
      .def("__len__", &FeatureArrays::size);
}

}  // namespace adaptive_bvh::python
