#include "query.h"

#include <array>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "arrays.h"
#include "features.h"
#include "objects.h"
#include "query_docs.h"
#include "text.h"

namespace adaptive_bvh::python {

template <typename S>
void ContactLists::add(const fcl::Contact<S>& contact, bool is_swapped) {
  triangles.push_back(static_cast<int>(is_swapped ? contact.b2 : contact.b1));
  triangles.push_back(static_cast<int>(is_swapped ? contact.b1 : contact.b2));
  for (int k = 0; k < 3; ++k) {
    points.push_back(double(contact.pos[k]));
    normals.push_back(double(is_swapped ? -contact.normal[k] : contact.normal[k]));
  }
  depths.push_back(double(contact.penetration_depth));
}
template void ContactLists::add(const fcl::Contact<double>&, bool);
template void ContactLists::add(const fcl::Contact<float>&, bool);

Contacts ContactLists::arrays() && {
  const auto count = static_cast<py::ssize_t>(depths.size());
  return {{},
          adopt<std::int32_t>(std::move(triangles), {count, 2}),
          adopt<double>(std::move(points), {count, 3}),
          adopt<double>(std::move(normals), {count, 3}),
          adopt<double>(std::move(depths), {count})};
}

namespace {

// adaptive_bvh::distance would compile all of FCL's distances in single precision, for pairs that
// Python does not offer: every pair here is one of ours.
[[noreturn]] void refusePair() { throw std::logic_error("adaptive_bvh: a pair is not answered"); }

template <typename S>
Nearest nearestOf(const fcl::DistanceResult<S>& result, bool is_swapped) {
  Nearest nearest;
  nearest.distance = static_cast<double>(result.min_distance);
  for (int side = 0; side < 2; ++side) {
    const int from = is_swapped ? 1 - side : side;
    for (int k = 0; k < 3; ++k)
      nearest.points[std::size_t(3 * side + k)] = double(result.nearest_points[from][k]);
  }
  nearest.triangles = {static_cast<int>(is_swapped ? result.b2 : result.b1),
                       static_cast<int>(is_swapped ? result.b1 : result.b2)};
  return nearest;
}

Nearest distanceOf(const py::object& o1, const py::object& o2, const py::object& tf1,
                   const py::object& tf2, bool nearest_points) {
  const Objects objects = objectsFrom(o1, o2, tf1, tf2);
  Nearest nearest;
  queryObjects(objects, [&](auto geometry1, const auto& pose1, auto geometry2, const auto& pose2) {
    using S = typename std::decay_t<decltype(pose1)>::Scalar;
    fcl::DistanceResult<S> result;
    if (!detail::answerDistance<S>(geometry1, pose1, geometry2, pose2,
                                   fcl::DistanceRequest<S>(nearest_points), result))
      refusePair();
    nearest = nearestOf(result, objects.is_swapped);
  });
  return nearest;
}

template <typename S>
void addAll(const fcl::CollisionResult<S>& result, bool is_swapped, ContactLists& lists) {
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    lists.add(result.getContact(i), is_swapped);
}

template <typename S>
fcl::CollisionRequest<S> requestOf(const std::optional<long long>& max_contacts, bool contact) {
  const auto all = static_cast<long long>(std::numeric_limits<int>::max());
  return fcl::CollisionRequest<S>(static_cast<std::size_t>(max_contacts.value_or(all)), contact);
}

void requireCount(const std::optional<long long>& max_contacts) {
  if (max_contacts && *max_contacts < 0)
    throw py::value_error("max_contacts is " + std::to_string(*max_contacts) +
                          "; 0 or more is needed, or None for all");
}

Contacts collideOf(const py::object& o1, const py::object& o2, const py::object& tf1,
                   const py::object& tf2, const std::optional<long long>& max_contacts,
                   bool enable_contact, bool solid) {
  requireCount(max_contacts);
  const Objects objects = objectsFrom(o1, o2, tf1, tf2);
  ContactLists lists;
  queryObjects(objects, [&](auto geometry1, const auto& pose1, auto geometry2, const auto& pose2) {
    using S = typename std::decay_t<decltype(pose1)>::Scalar;
    fcl::CollisionResult<S> result;
    if (!detail::answerCollide<S>(geometry1, pose1, geometry2, pose2,
                                  requestOf<S>(max_contacts, enable_contact), result, solid))
      refusePair();
    addAll(result, objects.is_swapped, lists);
  });
  return std::move(lists).arrays();
}

Contacts selfCollideOf(const LockedMesh& mesh, const py::object& tf,
                       const std::optional<long long>& max_contacts, bool enable_contact,
                       const std::string& filter, const py::object& ignored,
                       const py::object& labels, const std::string& label_rule) {
  requireCount(max_contacts);
  const fcl::Transform3d pose = poseFrom(tf, "tf");
  const NeighbourFilter neighbours = neighbourFilter(filter);
  const std::vector<FeaturePair> pairs = ignoredFrom(ignored, "ignored", true);
  const Labels of_faces(labels, label_rule, mesh);
  ContactLists lists;
  mesh.query([&](const auto& m) {
    using S = ScalarOf<decltype(m)>;
    fcl::CollisionResult<S> result;
    selfCollide(m, poseAs<S>(pose), requestOf<S>(max_contacts, enable_contact), result, neighbours,
                of_faces.triangles(pairs));
    addAll(result, false, lists);
  });
  return std::move(lists).arrays();
}

void bindResults(py::module_& module) {
  py::class_<Nearest>(module, "DistanceResult", "The distance of two objects.")
      .def_readonly("distance", &Nearest::distance, docs::kDistanceValue)
      .def_property_readonly(
          "points",
          [](const Nearest& self) {
            return py::array_t<double>({2, 3}, self.points.data());
          },
          docs::kDistancePoints)
      .def_property_readonly(
          "triangles",
          [](const Nearest& self) { return py::array_t<std::int32_t>(2, self.triangles.data()); },
          "The triangles of these points, (2,) int32: -1 for a shape.")
      .def("__repr__", TextOf({"distance", "points", "triangles"}));
  py::class_<Contacts>(module, "Contacts", docs::kContacts)
      .def_readonly("pairs", &Contacts::pairs, docs::kContactPairs)
      .def_readonly("points", &Contacts::points, "(K, 3) float64, in the world.")
      .def_readonly(
          "normals", &Contacts::normals,
          "(K, 3) float64, unit vectors: of a mesh and a shape from the first object to the "
          "second, of two meshes normals of a triangle.")
      .def_readonly("depths", &Contacts::depths,
                    "(K,) float64, lengths: penetration depths, 0 or more.")
      .def("__len__", [](const Contacts& self) { return self.depths.shape(0); })
      .def("__repr__", TextOf({"pairs", "points", "normals", "depths"}));
}

}  // namespace

NeighbourFilter neighbourFilter(const std::string& name) {
  if (name == "shared vertex") return NeighbourFilter::SharedVertex;
  if (name == "shared edge") return NeighbourFilter::SharedEdge;
  if (name == "none") return NeighbourFilter::None;
  if (name == "beyond shared") return NeighbourFilter::BeyondShared;
  throw py::value_error("filter is '" + name +
                        "'; 'shared vertex', 'shared edge', 'beyond shared' or 'none' is needed");
}

Nearest nearestFrom(const fcl::DistanceResult<double>& result) { return nearestOf(result, false); }
Nearest nearestFrom(const fcl::DistanceResult<float>& result) { return nearestOf(result, false); }

void bindQuery(py::module_& module) {
  bindResults(module);
  module.def("distance", &distanceOf, py::arg("o1"), py::arg("o2"), py::arg("tf1") = py::none(),
             py::arg("tf2") = py::none(), py::kw_only(), py::arg("nearest_points") = true,
             docs::kDistance);
  module.def("collide", &collideOf, py::arg("o1"), py::arg("o2"), py::arg("tf1") = py::none(),
             py::arg("tf2") = py::none(), py::kw_only(), py::arg("max_contacts") = py::none(),
             py::arg("enable_contact") = true, py::arg("solid") = false, docs::kCollide);
  module.def("self_collide", &selfCollideOf, py::arg("mesh"), py::arg("tf") = py::none(),
             py::kw_only(), py::arg("max_contacts") = py::none(), py::arg("enable_contact") = true,
             py::arg("filter") = "shared vertex", py::arg("ignored") = py::none(),
             py::arg("labels") = py::none(), py::arg("label_rule") = "between", docs::kSelfCollide);
}

}  // namespace adaptive_bvh::python
