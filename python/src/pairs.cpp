#include <memory>
#include <mutex>
#include <optional>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "bind.h"
#include "locked_mesh.h"
#include "pose.h"
#include "query.h"

namespace adaptive_bvh::python {
namespace {

/// A C++ object that watches two meshes, CoherentDistance or CoherentProximity, with what keeps
/// them alive. Threads use it one after the other.
template <typename Watcher>
class MeshPair : public Bound {
 public:
  MeshPair(const LockedMesh& first, const LockedMesh& second)
      : first_(first.shared_from_this()), second_(second.shared_from_this()) {
    queryPair(*first_, *second_, [&](const Mesh& a, const Mesh& b) { watcher_.emplace(a, b); });
  }

  /// Returns `f(watcher)`, without the GIL.
  template <typename F>
  auto query(const F& f) {
    const py::gil_scoped_release nogil;
    const std::lock_guard alone(mutex_);
    const LockedMesh::PairLock lock(*first_, *second_);
    return f(*watcher_);
  }

 private:
  std::shared_ptr<const LockedMesh> first_, second_;
  std::mutex mutex_;
  std::optional<Watcher> watcher_;  ///< always there
};

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
  return pair.query([&](CoherentDistance& watcher) {
    fcl::DistanceResultd result;
    watcher.distance(poses.tf1, poses.tf2, fcl::DistanceRequestd(nearest_points), result);
    return Nearest(result);
  });
}

bool nextIsNearer(ProximityPair& pair, double distance, const py::object& tf1,
                  const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  return pair.query(
      [&](CoherentProximity& watcher) { return watcher.isNearer(poses.tf1, poses.tf2, distance); });
}

}  // namespace

void bindPairs(py::module_& module) {
  py::class_<DistancePair>(module, "CoherentDistance", kCoherentDistance)
      .def(py::init<const LockedMesh&, const LockedMesh&>(), "first"_a, "second"_a,
           "first, second: meshes.")
      .def("distance", &nextDistance, "tf1"_a = py::none(), "tf2"_a = py::none(), py::kw_only(),
           "nearest_points"_a = true,
           "The distance of the meshes placed by two poses, a DistanceResult: as distance gives "
           "it.");
  py::class_<ProximityPair>(module, "CoherentProximity", kCoherentProximity)
      .def(py::init<const LockedMesh&, const LockedMesh&>(), "first"_a, "second"_a,
           "first, second: meshes.")
      .def("is_nearer", &nextIsNearer, "distance"_a, py::kw_only(), "tf1"_a = py::none(),
           "tf2"_a = py::none(),
           "Whether the meshes placed by two poses are at most `distance`, a length, apart.")
      .def_property_readonly(
          "searches",
          [](ProximityPair& self) {
            return self.query([](auto& watcher) { return watcher.searches(); });
          },
          "How many calls had to search, so far.");
}

}  // namespace adaptive_bvh::python
