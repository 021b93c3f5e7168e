#include "scene.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "adaptive_bvh/scene.h"
#include "arrays.h"
#include "locked_mesh.h"
#include "objects.h"
#include "shapes.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kScene =
    R"(Many bodies: meshes that deform, and shapes. One tree of boxes over the bodies finds the pairs
that may be near. Call `update` after all changes of a step, before its first query: a query raises
RuntimeError when something has changed since.

dtype: numbers of all meshes, float64 or float32.
Pairs of two shapes are left out. Bodies are named by numbers that `add` gives, never again. Results
are sorted by body, the smaller number of a pair first, and are in the world.)";

constexpr const char* kAdd =
    R"(Adds a body, a DeformableMesh or a shape. Several bodies may share one. Returns its number.

tf: pose that places it in the world.
group, mask: bits; two bodies are a pair where each one's mask has a bit of the other's group.
self_collision: whether the queries of pairs include the mesh with itself, without triangles that
share a vertex.)";

constexpr const char* kCollisions =
    R"(Pairs of bodies that touch, and their contacts.

contacts_per_pair: at most so many of each pair; None for all, 0 for pairs only. Returns
SceneCollisions.)";
}  // namespace docs

namespace {

using DoubleArray = py::array_t<double>;
using LongArray = py::array_t<std::int64_t>;

LongArray idsOfPairs(const std::vector<BodyPair>& pairs) {
  std::vector<std::int64_t> ids;
  for (const BodyPair& pair : pairs) {
    ids.push_back(pair.first);
    ids.push_back(pair.second);
  }
  return adopt<std::int64_t>(std::move(ids), {static_cast<py::ssize_t>(pairs.size()), 2});
}
LongArray offsetsOf(const std::vector<std::size_t>& offsets) {
  std::vector<std::int64_t> numbers(offsets.begin(), offsets.end());
  const auto count = static_cast<py::ssize_t>(numbers.size());
  return adopt<std::int64_t>(std::move(numbers), {count});
}

struct SceneCollisionArrays : Bound {
  LongArray bodies, offsets;
  py::array_t<std::int32_t> pairs;
  DoubleArray points, normals, depths;
};
struct ScenePairArrays : Bound {
  LongArray bodies, offsets;
  py::array_t<std::int32_t> triangles;
  DoubleArray distances;
};
struct NearestBody : Bound {
  std::int64_t first, second;
  double distance;
  std::array<double, 6> points;
  std::array<int, 2> triangles;
};

template <typename S>
NearestBody sceneDistanceOf(const SceneDistance<S>& found) {
  NearestBody nearest;
  nearest.first = found.bodies.first;
  nearest.second = found.bodies.second;
  nearest.distance = double(found.distance);
  for (std::size_t side = 0; side < 2; ++side)
    for (int k = 0; k < 3; ++k)
      nearest.points[3 * side + std::size_t(k)] = double(found.points[side][k]);
  nearest.triangles = found.elements;
  return nearest;
}

/// One of the two scenes of the library, the meshes that it refers to, and a lock.
class LockedScene : public Bound {
 public:
  explicit LockedScene(const py::object& dtype) {
    const py::dtype type = py::dtype::from_args(dtype);
    if (type.is(py::dtype::of<float>()) || type.equal(py::dtype::of<float>()))
      scene_.emplace<Scene<float>>();
    else if (!type.equal(py::dtype::of<double>()))
      throw py::type_error("dtype must be float64 or float32");
  }

  /// Runs f(scene) alone, without the GIL, and with the locks of all meshes.
  template <typename F>
  auto change(const F& f) {
    const py::gil_scoped_release nogil;
    const std::unique_lock alone(mutex_);
    return std::visit(f, scene_);
  }
  template <typename F>
  auto changeWithMeshes(const F& f) {
    const py::gil_scoped_release nogil;
    const std::unique_lock alone(mutex_);
    const auto locks = lockMeshes();
    return std::visit(f, scene_);
  }
  /// As above, beside other queries.
  template <typename F>
  auto query(const F& f) const {
    const py::gil_scoped_release nogil;
    const std::shared_lock shared(mutex_);
    const auto locks = lockMeshes();
    return std::visit(f, scene_);
  }

  std::int64_t add(const py::object& body, const py::object& tf, std::uint32_t group,
                   std::uint32_t mask, bool self_collision) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    BodyOptions options;
    options.group = group;
    options.mask = mask;
    options.self_collision = self_collision;
    std::shared_ptr<LockedMesh> mesh;
    std::optional<Shape> shape;
    if (py::isinstance<LockedMesh>(body))
      mesh = body.cast<std::shared_ptr<LockedMesh>>();
    else if (py::isinstance<Shape>(body))
      shape = body.cast<Shape>();
    else
      throw py::type_error("a body must be a DeformableMesh or a shape");
    const void* of_mesh = nullptr;  // it stays where it is
    if (mesh) mesh->query([&](const auto& m) { of_mesh = &m; });
    return change([&](auto& scene) -> std::int64_t {
      using S = typename std::decay_t<decltype(scene)>::Transform::Scalar;
      std::shared_ptr<const fcl::CollisionGeometry<S>> geometry;
      if (mesh) {
        if (mesh->isDouble() != (sizeof(S) == sizeof(double)))
          throw std::invalid_argument("the mesh has other numbers than the scene");
        geometry = {mesh, static_cast<const DeformableMesh<S>*>(of_mesh)};
      } else {
        geometry = shape->geometryPointer<S>();
      }
      const BodyId id = scene.add(std::move(geometry), poseAs<S>(pose), options);
      if (mesh) meshes_.emplace_back(id, mesh);
      return id;
    });
  }
  void remove(BodyId body) {
    change([&](auto& scene) {
      scene.remove(body);
      const auto is_it = [&](const auto& entry) { return entry.first == body; };
      meshes_.erase(std::remove_if(meshes_.begin(), meshes_.end(), is_it), meshes_.end());
    });
  }
  void setTransform(BodyId body, const py::object& tf) {
    const fcl::Transform3d pose = poseFrom(tf, "tf");
    change([&](auto& scene) {
      using S = typename std::decay_t<decltype(scene)>::Transform::Scalar;
      scene.setTransform(body, poseAs<S>(pose));
    });
  }

 private:
  /// Always in the same order, each mesh once.
  std::vector<std::shared_lock<std::shared_mutex>> lockMeshes() const {
    std::set<const LockedMesh*> meshes;
    for (const auto& entry : meshes_) meshes.insert(entry.second.get());
    std::vector<std::shared_lock<std::shared_mutex>> locks;
    for (const LockedMesh* mesh : meshes) locks.push_back(mesh->share());
    return locks;
  }

  std::variant<Scene<double>, Scene<float>> scene_;
  std::vector<std::pair<BodyId, std::shared_ptr<LockedMesh>>> meshes_;
  mutable std::shared_mutex mutex_;
};

SceneCollisionArrays collisionsOfScene(const LockedScene& scene,
                                       std::optional<std::size_t> contacts_per_pair,
                                       bool enable_contact) {
  SceneCollisionRequest request;
  if (contacts_per_pair) request.contacts_per_pair = *contacts_per_pair;
  request.enable_contact = enable_contact;
  std::vector<BodyPair> bodies;
  std::vector<std::size_t> offsets;
  std::vector<int> pairs;
  std::vector<double> points, normals, depths;
  scene.query([&](const auto& s) {
    using S = typename std::decay_t<decltype(s)>::Transform::Scalar;
    SceneCollisions<S> found;
    s.collisions(request, found);
    bodies = std::move(found.pairs);
    offsets = std::move(found.offsets);
    for (const fcl::Contact<S>& contact : found.contacts) {
      pairs.push_back(static_cast<int>(contact.b1));
      pairs.push_back(static_cast<int>(contact.b2));
      for (int k = 0; k < 3; ++k) {
        points.push_back(double(contact.pos[k]));
        normals.push_back(double(contact.normal[k]));
      }
      depths.push_back(double(contact.penetration_depth));
    }
  });
  const auto count = static_cast<py::ssize_t>(depths.size());
  SceneCollisionArrays arrays;
  arrays.bodies = idsOfPairs(bodies);
  arrays.offsets = offsetsOf(offsets);
  arrays.pairs = adopt<std::int32_t>(std::move(pairs), {count, 2});
  arrays.points = adopt<double>(std::move(points), {count, 3});
  arrays.normals = adopt<double>(std::move(normals), {count, 3});
  arrays.depths = adopt<double>(std::move(depths), {count});
  return arrays;
}

ScenePairArrays pairsWithinOfScene(const LockedScene& scene, double distance,
                                   bool enable_distances) {
  std::vector<BodyPair> bodies;
  std::vector<std::size_t> offsets;
  std::vector<FeaturePair> triangles;
  std::vector<double> distances;
  scene.query([&](const auto& s) {
    using S = typename std::decay_t<decltype(s)>::Transform::Scalar;
    ProximityRequest<S> request;
    request.distance = static_cast<S>(distance);
    request.enable_distances = enable_distances;
    SceneTrianglePairs<S> found;
    s.pairsWithin(request, found);
    bodies = std::move(found.pairs);
    offsets = std::move(found.offsets);
    triangles = std::move(found.found.triangles);
    distances.assign(found.found.distances.begin(), found.found.distances.end());
  });
  const auto count = static_cast<py::ssize_t>(triangles.size()),
             measured = static_cast<py::ssize_t>(distances.size());
  ScenePairArrays arrays;
  arrays.bodies = idsOfPairs(bodies);
  arrays.offsets = offsetsOf(offsets);
  arrays.triangles = adopt<std::int32_t>(std::move(triangles), {count, 2});
  arrays.distances = adopt<double>(std::move(distances), {measured});
  return arrays;
}

py::object nearestPointOfScene(const LockedScene& scene, const py::object& point) {
  const auto x = pointFrom<double>(point, "point");
  std::int64_t body = -1, triangle = -1;
  double distance = 0;
  std::array<double, 3> at{};
  scene.query([&](const auto& s) {
    using S = typename std::decay_t<decltype(s)>::Transform::Scalar;
    const ScenePoint<S> found = s.nearestPoint(x.template cast<S>());
    distance = double(found.distance);
    if (found.triangle < 0) return;
    body = found.body;
    triangle = found.triangle;
    for (int k = 0; k < 3; ++k) at[std::size_t(k)] = double(found.point[k]);
  });
  return py::make_tuple(body, distance, py::array_t<double>(3, at.data()), triangle);
}

py::object firstHitsOfScene(const LockedScene& scene, const py::object& origins,
                            const py::object& directions) {
  const Rows<double> from = rowsFrom<double>(origins, "origins"),
                     along = rowsFrom<double>(directions, "directions");
  requireRows(along, static_cast<std::size_t>(from.shape(0)), "directions");
  const auto count = static_cast<std::size_t>(from.shape(0));
  const auto *o = pointsOf<double>(from), *d = pointsOf<double>(along);
  std::vector<std::int64_t> bodies, triangles;
  std::vector<double> t;
  scene.query([&](const auto& s) {
    using S = typename std::decay_t<decltype(s)>::Transform::Scalar;
    std::vector<fcl::Vector3<S>> starts, ways;
    for (std::size_t i = 0; i < count; ++i) {
      starts.push_back(o[i].template cast<S>());
      ways.push_back(d[i].template cast<S>());
    }
    std::vector<SceneRayHit<S>> hits;
    s.firstHits(starts.data(), ways.data(), count, hits);
    for (const SceneRayHit<S>& hit : hits) {
      bodies.push_back(hit.hit.triangle < 0 ? -1 : std::int64_t(hit.body));
      triangles.push_back(hit.hit.triangle);
      t.push_back(double(hit.hit.t));
    }
  });
  const auto n = static_cast<py::ssize_t>(count);
  return py::make_tuple(adopt<double>(std::move(t), {n}),
                        adopt<std::int64_t>(std::move(bodies), {n}),
                        adopt<std::int64_t>(std::move(triangles), {n}));
}

void bindSceneResults(py::module_& module) {
  py::class_<SceneCollisionArrays>(module, "SceneCollisions",
                                   "Pairs of bodies that touch. len() counts them.")
      .def_readonly("bodies", &SceneCollisionArrays::bodies, "(P, 2) int64: numbers of bodies.")
      .def_readonly("offsets", &SceneCollisionArrays::offsets,
                    "(P + 1,) int64: pair i has the contacts from offsets[i] to offsets[i + 1].")
      .def_readonly("pairs", &SceneCollisionArrays::pairs,
                    "(K, 2) int32: of each contact the triangles of both bodies; -1 of a shape.")
      .def_readonly("points", &SceneCollisionArrays::points, "(K, 3) float64, in the world.")
      .def_readonly("normals", &SceneCollisionArrays::normals,
                    "(K, 3) float64, of length 1, as those of collide.")
      .def_readonly("depths", &SceneCollisionArrays::depths, "(K,) float64.")
      .def("__len__", [](const SceneCollisionArrays& self) { return self.bodies.shape(0); })
      .def("__repr__", [](const SceneCollisionArrays& self) {
        return "<adaptive_bvh.SceneCollisions: " + std::to_string(self.bodies.shape(0)) +
               " pairs, " + std::to_string(self.depths.shape(0)) + " contacts>";
      });
  py::class_<ScenePairArrays>(module, "SceneTrianglePairs",
                              "Pairs of triangles that are near, by pairs of bodies.")
      .def_readonly("bodies", &ScenePairArrays::bodies, "(P, 2) int64: numbers of bodies.")
      .def_readonly("offsets", &ScenePairArrays::offsets,
                    "(P + 1,) int64: pair i has the triangles from offsets[i] to offsets[i + 1].")
      .def_readonly("triangles", &ScenePairArrays::triangles, "(K, 2) int32.")
      .def_readonly("distances", &ScenePairArrays::distances,
                    "(K,) float64, or empty when they were not asked for.")
      .def("__len__", [](const ScenePairArrays& self) { return self.triangles.shape(0); })
      .def("__repr__", [](const ScenePairArrays& self) {
        return "<adaptive_bvh.SceneTrianglePairs: " + std::to_string(self.triangles.shape(0)) +
               " of " + std::to_string(self.bodies.shape(0)) + " pairs of bodies>";
      });
  py::class_<NearestBody>(module, "SceneDistance", "Two bodies, and how far apart they are.")
      .def_property_readonly(
          "bodies", [](const NearestBody& self) { return py::make_tuple(self.first, self.second); },
          "Numbers of bodies; of Scene.nearest the body that was asked for comes first.")
      .def_readonly("distance", &NearestBody::distance, "Infinite where there is no pair.")
      .def_property_readonly(
          "points",
          [](const NearestBody& self) {
            return py::array_t<double>({2, 3}, self.points.data());
          },
          "(2, 3) float64: on the first body and on the second, in the world.")
      .def_property_readonly(
          "triangles",
          [](const NearestBody& self) {
            return py::make_tuple(self.triangles[0], self.triangles[1]);
          },
          "Of these points; -1 of a shape.")
      .def("__repr__", [](const NearestBody& self) {
        return "<adaptive_bvh.SceneDistance: " + std::string(py::repr(py::float_(self.distance))) +
               " between " + std::to_string(self.first) + " and " + std::to_string(self.second) +
               ">";
      });
}

}  // namespace

void bindScene(py::module_& module) {
  bindSceneResults(module);
  py::class_<LockedScene> scene(module, "Scene", docs::kScene);
  scene.def(py::init<const py::object&>(), py::arg("dtype") = "float64")
      .def("add", &LockedScene::add, py::arg("body"), py::arg("tf") = py::none(), py::kw_only(),
           py::arg("group") = 1, py::arg("mask") = 0xffffffffu, py::arg("self_collision") = false,
           docs::kAdd)
      .def("remove", &LockedScene::remove, py::arg("body"), "Removes a body.")
      .def("set_transform", &LockedScene::setTransform, py::arg("body"), py::arg("tf"),
           "Moves a body; tf is a pose.")
      .def(
          "ignore",
          [](LockedScene& self, BodyId a, BodyId b) {
            self.change([&](auto& s) { s.ignore(a, b); });
          },
          py::arg("first"), py::arg("second"), "Leaves a pair of bodies out.")
      .def(
          "unignore",
          [](LockedScene& self, BodyId a, BodyId b) {
            self.change([&](auto& s) { s.unignore(a, b); });
          },
          py::arg("first"), py::arg("second"), "Takes `ignore` back.")
      .def(
          "set_threads",
          [](LockedScene& self, int threads) {
            self.change([&](auto& s) { s.setThreads(threads); });
          },
          py::arg("threads"), "Threads of queries, 1 or more.")
      .def(
          "update", [](LockedScene& self) { self.changeWithMeshes([](auto& s) { s.update(); }); },
          "Computes the boxes of all bodies: after all changes of a step.")
      .def(
          "begin_step", [](LockedScene& self) { self.change([](auto& s) { s.beginStep(); }); },
          "Remembers all poses: where the step of earliest_impact begins.")
      .def("__len__",
           [](const LockedScene& self) {
             return self.query([](const auto& s) { return s.size(); });
           })
      .def("collisions", &collisionsOfScene, py::kw_only(),
           py::arg("contacts_per_pair") = py::none(), py::arg("enable_contact") = true,
           docs::kCollisions)
      .def("pairs_within", &pairsWithinOfScene, py::arg("distance"), py::kw_only(),
           py::arg("enable_distances") = false,
           "Pairs of triangles of two meshes at most `distance` apart. Returns SceneTrianglePairs.")
      .def(
          "is_nearer",
          [](const LockedScene& self, double distance) {
            return self.query([&](const auto& s) {
              using S = typename std::decay_t<decltype(s)>::Transform::Scalar;
              return s.isNearer(static_cast<S>(distance));
            });
          },
          py::arg("distance"), "Whether any two bodies are at most so far apart.")
      .def(
          "nearest",
          [](LockedScene& self, BodyId body) {
            return self.changeWithMeshes([&](auto& s) { return sceneDistanceOf(s.nearest(body)); });
          },
          py::arg("body"), "The body nearest to one. Remembers it for the next step.")
      .def(
          "distance",
          [](LockedScene& self) {
            return self.changeWithMeshes([&](auto& s) { return sceneDistanceOf(s.distance()); });
          },
          "The two bodies that are nearest. Remembers them for the next step.")
      .def("nearest_point", &nearestPointOfScene, py::arg("point"),
           "Of all meshes: (body, distance, point, triangle); body and triangle are -1 where there "
           "is no mesh.")
      .def("first_hits", &firstHitsOfScene, py::arg("origins"), py::arg("directions"),
           "The first hits of rays, (N, 3) each, with meshes: arrays (t, bodies, triangles) of N; "
           "t is infinite and the others -1 where a ray meets nothing.")
      .def(
          "largest_safe_step",
          [](const LockedScene& self, double separation) {
            return self.query([&](const auto& s) { return s.largestSafeStep(separation); });
          },
          py::arg("separation") = 0.,
          "The time, from 0 to 1, up to which no meshes come nearer than `separation`, from the "
          "last begin_step to now.");
}

}  // namespace adaptive_bvh::python
