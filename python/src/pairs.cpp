#include "pairs.h"

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "objects.h"
#include "query.h"

namespace adaptive_bvh::python {
namespace {

using DistancePair = ModelPair<CoherentDistance>;
using ProximityPair = ModelPair<CoherentProximity>;

constexpr const char* kCoherentDistance =
    R"(The exact distance of two models that are followed step by step: the fastest way.

Answers as distance does, and starts where the last step's search ended. Any number of updates may
come between two calls. Keeps the models alive. Threads use one object one after the other.)";

constexpr const char* kCoherentProximity =
    R"(is_nearer for two models that are followed step by step.

Does not search at all while nothing can have come near. Keeps the models alive. Threads use one
object one after the other.)";

template <typename Watcher>
using ScalarOfWatcher = typename std::decay_t<Watcher>::S;

Nearest nextDistance(DistancePair& pair, const py::object& tf1, const py::object& tf2,
                     bool nearest_points) {
  const fcl::Transform3d pose1 = poseFrom(tf1, "tf1"), pose2 = poseFrom(tf2, "tf2");
  Nearest nearest;
  pair.query([&](auto& watcher) {
    using S = ScalarOfWatcher<decltype(watcher)>;
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
    using S = ScalarOfWatcher<decltype(watcher)>;
    is_nearer = watcher.isNearer(poseAs<S>(pose1), poseAs<S>(pose2), static_cast<S>(distance));
  });
  return is_nearer;
}

}  // namespace

void bindPairs(py::module_& module) {
  py::class_<DistancePair>(module, "CoherentDistance", kCoherentDistance)
      .def(py::init<const Model&, const Model&>(), py::arg("first"), py::arg("second"),
           "first, second: models of the same volume and dtype.")
      .def(
          "distance", &nextDistance, py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
          py::kw_only(), py::arg("nearest_points") = true,
          "The distance of the models placed by two poses, a DistanceResult: as distance gives it.")
      .def_property_readonly(
          "front_size",
          [](DistancePair& self) {
            std::size_t size = 0;
            self.query([&](auto& watcher) { size = watcher.frontSize(); });
            return size;
          },
          "Pairs of nodes that are remembered; 0 when the next search starts at the roots.");
  py::class_<ProximityPair>(module, "CoherentProximity", kCoherentProximity)
      .def(py::init<const Model&, const Model&>(), py::arg("first"), py::arg("second"),
           "first, second: models of the same volume and dtype.")
      .def("is_nearer", &nextIsNearer, py::arg("distance"), py::arg("tf1") = py::none(),
           py::arg("tf2") = py::none(),
           "Whether the models placed by two poses are at most `distance`, a length, apart.")
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
