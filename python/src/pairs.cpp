#include "pairs.h"

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "objects.h"
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

template <typename Watcher>
struct ScalarOfWatcher;
template <template <typename> class Watcher, typename S>
struct ScalarOfWatcher<Watcher<S>> {
  using Type = S;
};

Nearest nextDistance(DistancePair& pair, const py::object& tf1, const py::object& tf2,
                     bool nearest_points) {
  const fcl::Transform3d pose1 = poseFrom(tf1, "tf1"), pose2 = poseFrom(tf2, "tf2");
  Nearest nearest;
  pair.query([&](auto& watcher) {
    using S = typename ScalarOfWatcher<std::decay_t<decltype(watcher)>>::Type;
    fcl::DistanceResult<S> result;
    watcher.distance(poseAs<S>(pose1), poseAs<S>(pose2), fcl::DistanceRequest<S>(nearest_points),
                     result);
    nearest = nearestFrom(result);
  });
  return nearest;
}

bool nextIsNearer(ProximityPair& pair, double distance, const py::object& tf1,
                  const py::object& tf2) {
  const fcl::Transform3d pose1 = poseFrom(tf1, "tf1"), pose2 = poseFrom(tf2, "tf2");
  bool is_nearer = false;
  pair.query([&](auto& watcher) {
    using S = typename ScalarOfWatcher<std::decay_t<decltype(watcher)>>::Type;
    is_nearer = watcher.isNearer(poseAs<S>(pose1), poseAs<S>(pose2), static_cast<S>(distance));
  });
  return is_nearer;
}

}  // namespace

void bindPairs(py::module_& module) {
  py::class_<DistancePair>(module, "CoherentDistance", kCoherentDistance)
      .def(py::init<const LockedMesh&, const LockedMesh&>(), py::arg("first"), py::arg("second"),
           "first, second: meshes of the same dtype.")
      .def("distance", &nextDistance, py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
           py::kw_only(), py::arg("nearest_points") = true,
           "The distance of the meshes placed by two poses, a DistanceResult: as distance gives "
           "it.");
  py::class_<ProximityPair>(module, "CoherentProximity", kCoherentProximity)
      .def(py::init<const LockedMesh&, const LockedMesh&>(), py::arg("first"), py::arg("second"),
           "first, second: meshes of the same dtype.")
      .def("is_nearer", &nextIsNearer, py::arg("distance"), py::arg("tf1") = py::none(),
           py::arg("tf2") = py::none(),
           "Whether the meshes placed by two poses are at most `distance`, a length, apart.")
      .def_property_readonly(
          "searches",
          [](ProximityPair& self) {
            std::size_t searches = 0;
            self.query([&](auto& watcher) { searches = watcher.searches(); });
            return searches;
          },
          "How many calls had to search, so far.");
}

}  // namespace adaptive_bvh::python
