#include "adaptive_bvh/trust_region.h"

#include <mutex>
#include <optional>
#include <set>

#include "arrays.h"
#include "bind.h"
#include "locked_mesh.h"
#include "pose.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kTrustRegion =
    R"(Keeps the iterates of a solver apart: finds the pairs of near features once, for several
iterations.

Every vertex stays within a radius of where it was when pairs were found, and on its side of a plane
between each two near features. So no features come together on the straight ways from iterate to
iterate, in whatever order vertices move. Features that are at most `distance` apart come no
nearer; features that touch do not move. Keeps the meshes alive. Threads use one object one after
the other.)";

constexpr const char* kInit =
    R"(mesh: its triangles say what deforms; its positions are not read. Several bodies are one mesh.
radius: a length, how far a vertex may go from where pairs were found last.
distance: a length, which features keep.
most_held: pairs are found anew when the radius held back more than this share of the vertices.
ValueError on a radius that is not above 0, and on a negative or infinite distance.)";

constexpr const char* kAddObstacle =
    R"(Adds a DeformableMesh that does not move from one `begin` to the next, which reads its vertices.
Counts from the next `begin` on. Returns its number, from 0.)";

constexpr const char* kSetTransform =
    "Places an obstacle, from the next `begin` on. IndexError if there is none.";

constexpr const char* kBegin =
    "Accepts these positions, (num_vertices, 3), and finds the pairs around them.";

constexpr const char* kTruncate =
    R"(Moves each vertex from its accepted position as far toward the proposed one as is proven safe.

proposed: (num_vertices, 3). Returns the positions that are accepted now, an array of the same
shape, and a TrustRegionReport. ValueError before `begin`.)";
}  // namespace docs

namespace {

/// Python's TrustRegion: the library's, with the meshes that it reads, and its accepted positions.
class Region : public Bound {
 public:
  Region(const LockedMesh& mesh, double radius, double distance, double most_held)
      : meshes_{mesh.shared_from_this()} {
    TrustRegionRequest request;
    request.radius = radius;
    request.distance = distance;
    request.most_held = most_held;
    mesh.query([&](const Mesh& m) { region_.emplace(m, request); });
  }

  std::size_t addObstacle(const LockedMesh& obstacle, const py::object& tf) {
    const fcl::Transform3d placed = poseFrom(tf, "tf");
    return alone([&] {
      meshes_.push_back(obstacle.shared_from_this());
      return region_->addObstacle(obstacle.mesh(), placed);
    });
  }
  void setTransform(std::size_t obstacle, const py::object& tf) {
    const fcl::Transform3d placed = poseFrom(tf, "tf");
    alone([&] { region_->setTransform(obstacle, placed); });
  }
  void begin(const py::object& positions) {
    const Points start = pointsFrom(positions, "positions");
    alone([&] { region_->begin(start); });
  }
  py::tuple truncate(const py::object& proposed) {
    const Points wanted = pointsFrom(proposed, "proposed");
    Points accepted;
    const TrustRegionReport report = alone([&] { return region_->truncate(wanted, accepted); });
    return py::make_tuple(adopt(std::move(accepted)), report);
  }
  std::size_t numPairs() {
    return alone([&] { return region_->numPairs(); });
  }

 private:
  using Points = std::vector<fcl::Vector3d>;

  Points pointsFrom(const py::object& positions, const char* name) const {
    const Rows rows(positions, name);
    requireRows(rows.array(), meshes_.front()->numVertices(), name);
    return {rows.begin(), rows.end()};
  }
  /// Returns `f()`, without the GIL, while no other thread uses this object or changes the meshes.
  template <typename F>
  auto alone(const F& f) -> decltype(f()) {
    const py::gil_scoped_release nogil;
    const std::lock_guard lock(mutex_);
    std::set<const LockedMesh*> meshes;
    for (const auto& mesh : meshes_) meshes.insert(mesh.get());
    const auto locks = LockedMesh::shareAll(meshes);
    return f();
  }

  std::vector<std::shared_ptr<const LockedMesh>> meshes_;  ///< the mesh, then the obstacles
  std::mutex mutex_;
  std::optional<TrustRegion> region_;  ///< always there
};

}  // namespace

void bindTrustRegion(py::module_& module) {
  ResultClass<TrustRegionReport>(module, "TrustRegionReport", "What TrustRegion.truncate did.")
      .attribute("held_back", &TrustRegionReport::held_back,
                 "How many vertices did not reach the proposed position.")
      .attribute("held_by_radius", &TrustRegionReport::held_by_radius,
                 "How many of them because of the radius.")
      .attribute("has_searched", &TrustRegionReport::has_searched,
                 "Whether pairs were found anew first.");
  py::class_<Region>(module, "TrustRegion", docs::kTrustRegion)
      .def(py::init<const LockedMesh&, double, double, double>(), "mesh"_a, "radius"_a,
           "distance"_a = 0.0, "most_held"_a = 0.01, docs::kInit)
      .def("add_obstacle", &Region::addObstacle, "obstacle"_a, "tf"_a = py::none(),
           docs::kAddObstacle)
      .def("set_transform", &Region::setTransform, "obstacle"_a, "tf"_a = py::none(),
           docs::kSetTransform)
      .def("begin", &Region::begin, "positions"_a, docs::kBegin)
      .def("truncate", &Region::truncate, "proposed"_a, docs::kTruncate)
      .def_property_readonly("num_pairs", &Region::numPairs,
                             "How many pairs of features the last search found.");
}

}  // namespace adaptive_bvh::python
