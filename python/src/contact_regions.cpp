#include "contact_regions.h"

#include <string>

#include "adaptive_bvh/contact_regions.h"
#include "arrays.h"
#include "locked_mesh.h"
#include "objects.h"
#include "text.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kContactRegions =
    R"(Where two closed meshes overlap: the connected regions of the volume that both enclose, and the
curves along which their surfaces cross.

tf1, tf2: poses; results are in the world. Returns ContactRegions. Raises ValueError when a mesh is
open; the message names an edge.)";

constexpr const char* kTracker =
    R"(Gives the regions of one pair of meshes an identity over many steps, by the triangles that they
share with the regions of the last step.)";

constexpr const char* kTrack =
    R"(Takes the regions of another step. Returns a list of (change, id, other): one for each region, in
their order, and then one for each that has ended, by increasing id. `change` is "born",
"persisting", "split" (from the region `other`), "merged" (into the region `other`) or "gone".)";
}  // namespace docs

namespace {

/// N or N x 3 numbers.
using Doubles = py::array_t<double>;

struct RegionArrays : Bound {
  Doubles volumes, depths, deepest_points, normals, curve_points;
  PatchArrays first, second;
  py::array_t<std::int32_t> curve_first, curve_second, curve_regions;
  py::array_t<std::int64_t> curve_begins;
  ContactRegions<float> tracked;  ///< what a tracker reads: how many there are, and triangles
};

template <typename T, typename Element>
py::array_t<T> rowArray(std::vector<Element>&& numbers) {
  const auto count = static_cast<py::ssize_t>(numbers.size());
  return adopt<T>(std::move(numbers), {count});
}
template <typename S>
Doubles doubleArray(std::vector<S>&& numbers) {
  const auto count = static_cast<py::ssize_t>(numbers.size());
  return adoptDoubles<S>(std::move(numbers), {count});
}
template <typename S>
Doubles pointArray(std::vector<fcl::Vector3<S>>&& points) {
  const auto count = static_cast<py::ssize_t>(points.size());
  return adoptDoubles<S>(std::move(points), {count, 3});
}

template <typename S>
PatchArrays arraysOf(ContactPatches<S>&& p) {
  PatchArrays arrays;
  arrays.areas = doubleArray(std::move(p.areas));
  arrays.centroids = pointArray(std::move(p.centroids));
  arrays.triangles = rowArray<std::int32_t>(std::move(p.triangles));
  arrays.begins = rowArray<std::int64_t>(std::move(p.begins));
  return arrays;
}

template <typename S>
RegionArrays arraysOf(ContactRegions<S>&& r) {
  RegionArrays arrays;
  arrays.tracked.volumes.resize(r.size());
  arrays.tracked.first.triangles = r.first.triangles;
  arrays.tracked.first.begins = r.first.begins;
  arrays.tracked.second.triangles = r.second.triangles;
  arrays.tracked.second.begins = r.second.begins;
  arrays.volumes = doubleArray(std::move(r.volumes));
  arrays.depths = doubleArray(std::move(r.depths));
  arrays.deepest_points = pointArray(std::move(r.deepest_points));
  arrays.normals = pointArray(std::move(r.normals));
  arrays.first = arraysOf(std::move(r.first));
  arrays.second = arraysOf(std::move(r.second));
  arrays.curve_points = pointArray(std::move(r.curve_points));
  arrays.curve_first = rowArray<std::int32_t>(std::move(r.curve_first));
  arrays.curve_second = rowArray<std::int32_t>(std::move(r.curve_second));
  arrays.curve_begins = rowArray<std::int64_t>(std::move(r.curve_begins));
  arrays.curve_regions = rowArray<std::int32_t>(std::move(r.curve_regions));
  return arrays;
}

RegionArrays regionsOf(const LockedMesh& first, const LockedMesh& second, const py::object& tf1,
                       const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  ContactRegions<double> of_double;
  ContactRegions<float> of_float;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    if constexpr (std::is_same_v<S, double>)
      contactRegions(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), of_double);
    else
      contactRegions(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), of_float);
  });
  return first.isDouble() ? arraysOf(std::move(of_double)) : arraysOf(std::move(of_float));
}

/// Python's ContactTracker.
struct Tracker : Bound {
  ContactTracker tracker;

  py::list track(const RegionArrays& regions) {
    static constexpr const char* kNames[] = {"born", "persisting", "split", "merged", "gone"};
    tracker.track(regions.tracked);
    py::list events;
    for (const ContactEvent& event : tracker.events())
      events.append(py::make_tuple(kNames[static_cast<int>(event.change)], event.id, event.other));
    return events;
  }
  py::array_t<std::int64_t> ids() const {
    return rowArray<std::int64_t>(std::vector<std::uint64_t>(tracker.ids()));
  }
};

void bindPatches(py::module_& module) {
  py::class_<PatchArrays>(module, "ContactPatches",
                          "The part of one mesh's surface inside the other, region by region.")
      .def_readonly("areas", &PatchArrays::areas, "(R,) float64.")
      .def_readonly("centroids", &PatchArrays::centroids, "(R, 3) float64, in the world.")
      .def_readonly("triangles", &PatchArrays::triangles,
                    "(T,) int32: those of region r are triangles[begins[r]:begins[r + 1]].")
      .def_readonly("begins", &PatchArrays::begins, "(R + 1,) int64.")
      .def("__repr__", TextOf({"areas", "centroids", "triangles", "begins"}));
}

void bindRegions(py::module_& module) {
  using R = RegionArrays;
  py::class_<R>(module, "ContactRegions",
                "Regions that two closed meshes share, by their smallest triangle. len() counts "
                "them.")
      .def_readonly("volumes", &R::volumes, "(R,) float64: of the common volume.")
      .def_readonly("depths", &R::depths,
                    "(R,) float64: the largest distance, of a vertex or of a triangle's centroid "
                    "inside the other mesh, to the other's surface.")
      .def_readonly("deepest_points", &R::deepest_points, "(R, 3) float64, in the world.")
      .def_readonly(
          "normals", &R::normals,
          "(R, 3) float64: mean normals, from the first mesh to the second, without faces "
          "that coincide; zero where they cancel each other.")
      .def_property_readonly(
          "first", [](const R& self) { return self.first; }, "Patches of the first mesh.")
      .def_property_readonly(
          "second", [](const R& self) { return self.second; }, "Patches of the second mesh.")
      .def_readonly("curve_points", &R::curve_points,
                    "(K, 3) float64: closed curve c is "
                    "curve_points[curve_begins[c]:curve_begins[c + 1]].")
      .def_readonly("curve_first", &R::curve_first,
                    "(K,) int32: the first's triangle from each point to the next.")
      .def_readonly("curve_second", &R::curve_second, "(K,) int32: the second's.")
      .def_readonly("curve_begins", &R::curve_begins, "(C + 1,) int64.")
      .def_readonly("curve_regions", &R::curve_regions, "(C,) int32: the region of each curve.")
      .def("__len__", [](const R& self) { return self.volumes.shape(0); })
      .def("__repr__", TextOf({"volumes", "depths", "deepest_points", "normals", "first", "second",
                               "curve_points", "curve_first", "curve_second", "curve_begins",
                               "curve_regions"}));
}

}  // namespace

void bindContactRegions(py::module_& module) {
  bindPatches(module);
  bindRegions(module);
  module.def("contact_regions", &regionsOf, py::arg("first"), py::arg("second"),
             py::arg("tf1") = py::none(), py::arg("tf2") = py::none(), docs::kContactRegions);
  py::class_<Tracker>(module, "ContactTracker", docs::kTracker)
      .def(py::init<>(), "Without regions.")
      .def("track", &Tracker::track, py::arg("regions"), docs::kTrack)
      .def(
          "clear", [](Tracker& self) { self.tracker.clear(); },
          "Forgets all regions; identities are not used again.")
      .def_property_readonly("ids", &Tracker::ids,
                             "(R,) int64: of the regions of the last step, in their order.");
}

}  // namespace adaptive_bvh::python
