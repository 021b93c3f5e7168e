#include "contact_regions.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "arrays.h"
#include "bind.h"
#include "locked_mesh.h"
#include "results.h"

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

ContactPatches checkedPatches(const ContactPatches& patches, const std::string& name) {
  constexpr std::size_t kLimit = std::numeric_limits<int>::max();
  ContactPatches copy;
  copy.triangles = patches.triangles;
  for (std::size_t i = 0; i < copy.triangles.size(); ++i)
    requireIndex(static_cast<std::int32_t>(copy.triangles[i]), kLimit,
                 (name + ".triangles").c_str(), i, "triangles at most");
  copy.begins = patches.begins;
  if (!std::is_sorted(copy.begins.begin(), copy.begins.end()) ||
      (!copy.begins.empty() && copy.begins.back() > copy.triangles.size()))
    throw py::value_error(name + ".begins does not increase from 0 to the number of triangles");
  return copy;
}

namespace {

ContactRegions regionsOf(const LockedMesh& first, const LockedMesh& second, const py::object& tf1,
                         const py::object& tf2) {
  return findPlaced<ContactRegions>(
      first, second, Poses(tf1, tf2),
      [](auto& regions, const auto&... placed) { contactRegions(placed..., regions); });
}

/// Python's ContactTracker.
struct Tracker : Bound {
  ContactTracker tracker;

  py::list track(const ContactRegions& regions) {
    static constexpr const char* kNames[] = {"born", "persisting", "split", "merged", "gone"};
    ContactRegions checked;
    checked.volumes = regions.volumes;
    checked.first = checkedPatches(regions.first, "first");
    checked.second = checkedPatches(regions.second, "second");
    tracker.track(checked);
    py::list events;
    for (const ContactEvent& event : tracker.events())
      events.append(py::make_tuple(kNames[static_cast<int>(event.change)], event.id, event.other));
    return events;
  }
};

void bindPatches(py::module_& module) {
  using P = ContactPatches;
  ResultClass<P>(module, "ContactPatches",
                 "The part of one mesh's surface inside the other, region by region.")
      .attribute("areas", &P::areas, "(R,) float64.")
      .attribute("centroids", &P::centroids, "(R, 3) float64, in the world.")
      .attribute("triangles", &P::triangles,
                 "(T,) int32: those of region r are triangles[begins[r]:begins[r + 1]].")
      .attribute("begins", &P::begins, "(R + 1,) int64.");
}

void bindRegions(py::module_& module) {
  using R = ContactRegions;
  ResultClass<R>(module, "ContactRegions",
                 "Regions that two closed meshes share, by their smallest triangle. len() counts "
                 "them.")
      .attribute("volumes", &R::volumes, "(R,) float64: of the common volume.")
      .attribute("depths", &R::depths,
                 "(R,) float64: the largest distance, of a vertex or of a triangle's centroid "
                 "inside the other mesh, to the other's surface.")
      .attribute("deepest_points", &R::deepest_points, "(R, 3) float64, in the world.")
      .attribute("normals", &R::normals,
                 "(R, 3) float64: mean normals, from the first mesh to the second, without faces "
                 "that coincide; zero where they cancel each other.")
      .attribute("first", &R::first, "Patches of the first mesh.")
      .attribute("second", &R::second, "Patches of the second mesh.")
      .attribute("curve_points", &R::curve_points,
                 "(K, 3) float64: closed curve c is "
                 "curve_points[curve_begins[c]:curve_begins[c + 1]].")
      .attribute("curve_first", &R::curve_first,
                 "(K,) int32: the first's triangle from each point to the next.")
      .attribute("curve_second", &R::curve_second, "(K,) int32: the second's.")
      .attribute("curve_begins", &R::curve_begins, "(C + 1,) int64.")
      .attribute("curve_regions", &R::curve_regions, "(C,) int32: the region of each curve.")
      .length(&R::volumes);
}

}  // namespace

void bindContactRegions(py::module_& module) {
  bindPatches(module);
  bindRegions(module);
  module.def("contact_regions", &regionsOf, "first"_a, "second"_a, py::kw_only(),
             "tf1"_a = py::none(), "tf2"_a = py::none(), docs::kContactRegions);
  py::class_<Tracker>(module, "ContactTracker", docs::kTracker)
      .def(py::init<>(), "Without regions.")
      .def("track", &Tracker::track, "regions"_a, docs::kTrack)
      .def(
          "clear", [](Tracker& self) { self.tracker.clear(); },
          "Forgets all regions; identities are not used again.")
      .def_property_readonly(
          "ids",
          [](const Tracker& self) { return adopt(std::vector<std::uint64_t>(self.tracker.ids())); },
          "(R,) int64: of the regions of the last step, in their order.");
}

}  // namespace adaptive_bvh::python
