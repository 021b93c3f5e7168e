#include "pairs.h"

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "bind.h"
#include "pose.h"
#include "query.h"

namespace adaptive_bvh::python {
namespace {

using DistancePair = MeshPair<CoherentDistance>;
using ProximityPair = MeshPair<CoherentProximity>;

constexpr const char* kCoherentDistance =
    R"(The exact distance of two meshes that are followed step by step.

Answers as distance does, and starts from the triangles that were nearest in the last step. Any
number of updates may come between two calls. Keeps the meshes alive. Threads use one object one
after the other.)";

constexpr const char* kCoherentProximity =
    R"(is_nearer for two meshes that are followed step by step.

Does not search at all while nothing can have come near. Keeps the meshes alive. Threads use one
object one after the other.)";

Nearest nextDistance(DistancePair& pair, const py::object& tf1, const py::object& tf2,
                     bool nearest_points) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  return pair.query([&](CoherentDistance<double>& watcher) {
    fcl::DistanceResultd result;
    watcher.distance(poses.tf1, poses.tf2, fcl::DistanceRequestd(nearest_points), result);
    return Nearest(result);
  });
}

bool nextIsNearer(ProximityPair& pair, double distance, const py::object& tf1,
                  const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  return pair.query([&](CoherentProximity<double>& watcher) {
    return watcher.isNearer(poses.tf1, poses.tf2, distance);
  });
}

}  // namespace

void bindPairs(py::module_& module) {
  py::class_<DistancePair>(module, "CoherentDistance", kCoherentDistance)
      .def(py::init<const LockedMesh&, const LockedMesh&>(), py::arg("first"), py::arg("second"),
           "first, second: meshes.")
      .def("distance", &nextDistance, py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
           py::kw_only(), py::arg("nearest_points") = true,
           "The distance of the meshes placed by two poses, a DistanceResult: as distance gives "
           "it.");
  py::class_<ProximityPair>(module, "CoherentProximity", kCoherentProximity)
      .def(py::init<const LockedMesh&, const LockedMesh&>(), py::arg("first"), py::arg("second"),
           "first, second: meshes.")
      .def("is_nearer", &nextIsNearer, py::arg("distance"), py::arg("tf1") = py::none(),
           py::arg("tf2") = py::none(),
           "Whether the meshes placed by two poses are at most `distance`, a length, apart.")
      .def_property_readonly(
          "searches",
          [](ProximityPair& self) {
            return self.query([](auto& watcher) { return watcher.searches(); });
          },
          "How many calls had to search, so far.");
}

}  // namespace adaptive_bvh::python
