#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include <fcl/geometry/shape/sphere.h>

#include "locked_scene.h"
#include "objects.h"
#include "results.h"

// Copies of scenes.
namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kSnapshot =
    R"(A scene of its own in the present state, with the same numbers of bodies, also as copy.copy and
copy.deepcopy. It has copies of the meshes, all of one moment, one copy for bodies that share a mesh;
`geometry` returns them, and the copy may change as any other scene. It keeps the poses of the last
begin_step, options, pairs that are left out, the filter and the number of threads; it is updated.

Pickle stores the same.)";
}  // namespace docs

namespace {

py::array matrixOf(const fcl::Transform3d& pose) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = pose.matrix();
  return py::array_t<double>({4, 4}, matrix.data());
}

/// One body, read while the locks are held.
struct BodyRow {
  BodyId id;
  fcl::Transform3d pose, start;
  BodyOptions options;

  py::tuple tuple(const py::object& geometry) const {
    return py::make_tuple(id, geometry, matrixOf(pose), matrixOf(start), options.group,
                          options.mask, options.self_collision, options.solid, options.user);
  }
};

BodyOptions optionsOf(const py::tuple& row) {
  return {row[4].cast<std::uint32_t>(), row[5].cast<std::uint32_t>(), row[6].cast<bool>(),
          row[7].cast<bool>(), row[8].cast<std::uintptr_t>()};
}

/// Copies of meshes, each made once.
class MeshCopies {
 public:
  void add(const LockedMesh& mesh) {
    if (!copies_.count(&mesh)) copies_.emplace(&mesh, Mesh(mesh.mesh()));
  }
  /// Python's copy of a mesh; other objects are returned. Needs the GIL.
  py::object of(const py::object& geometry) {
    const auto copy = copies_.find(asMesh(geometry));
    if (copy == copies_.end()) return geometry;
    py::object& wrapped = wrapped_[copy->first];
    if (!wrapped) wrapped = py::cast(std::make_shared<LockedMesh>(std::move(copy->second)));
    return wrapped;
  }

 private:
  std::map<const LockedMesh*, Mesh> copies_;
  std::map<const LockedMesh*, py::object> wrapped_;
};

}  // namespace

void LockedScene::ignore(BodyId first, BodyId second) {
  change([&](Scene& scene) {
    scene.ignore(first, second);
    ignored_.insert(std::minmax(first, second));
  });
}

void LockedScene::unignore(BodyId first, BodyId second) {
  change([&](Scene& scene) {
    scene.unignore(first, second);
    ignored_.erase(std::minmax(first, second));
  });
}

void LockedScene::ignoreNeighbours(const std::vector<BodyId>& chain) {
  change([&](Scene& scene) {
    scene.ignoreNeighbours(chain);
    for (std::size_t i = 1; i < chain.size(); ++i)
      ignored_.insert(std::minmax(chain[i - 1], chain[i]));
  });
}

void LockedScene::beginStep() {
  change([&](Scene& scene) {
    scene.beginStep();
    for (auto& [body, start] : starts_) start = scene.transform(body);
  });
}

void LockedScene::setThreads(int threads) {
  change([&](Scene& scene) {
    scene.setThreads(threads);
    threads_ = threads;
  });
}

py::tuple LockedScene::state(bool copies_meshes) const {
  std::vector<BodyRow> rows;
  MeshCopies copies;
  std::set<std::pair<BodyId, BodyId>> ignored;
  BodyId next = 0;
  int threads = 1;
  {
    const py::gil_scoped_release nogil;
    const Locks locks = share({});
    for (const auto& [body, start] : starts_)
      rows.push_back({body, scene_.transform(body), start, scene_.options(body)});
    if (copies_meshes)
      for (const auto& entry : meshes_) copies.add(*entry.second);
    ignored = ignored_;
    next = next_;
    threads = threads_;
  }
  py::list bodies, pairs;
  for (const BodyRow& row : rows) {
    const auto geometry = geometries_.find(row.id);
    if (geometry == geometries_.end()) continue;  // another thread adds or removes it now
    bodies.append(row.tuple(copies.of(geometry->second)));
  }
  for (const auto& [first, second] : ignored)
    if (geometries_.count(first) && geometries_.count(second))
      pairs.append(py::make_tuple(first, second));
  return py::make_tuple(next, bodies, pairs, threads, filter_);
}

std::unique_ptr<LockedScene> LockedScene::fromState(const py::tuple& state) {
  auto scene = std::make_unique<LockedScene>();
  const auto skipTo = [&](BodyId next) {  // numbers of bodies that were removed
    while (scene->next_ < next) {
      scene->next_ = scene->scene_.add(std::make_shared<fcl::Sphered>(1.)) + 1;
      scene->scene_.remove(scene->next_ - 1);
    }
  };
  const py::list bodies = state[1];
  for (const py::handle body : bodies) {
    const auto row = body.cast<py::tuple>();
    skipTo(row[0].cast<BodyId>());
    scene->add(row[1], row[3], optionsOf(row));
  }
  skipTo(state[0].cast<BodyId>());
  scene->beginStep();
  for (const py::handle body : bodies) {
    const auto row = body.cast<py::tuple>();
    scene->setTransform(row[0].cast<BodyId>(), row[2]);
  }
  for (const py::handle pair : state[2].cast<py::list>()) {
    const auto [first, second] = pair.cast<std::pair<BodyId, BodyId>>();
    scene->ignore(first, second);
  }
  scene->setThreads(state[3].cast<int>());
  scene->setFilter(state[4]);
  scene->changeWithMeshes([](Scene& s) { s.update(); });
  return scene;
}

void bindSceneState(SceneClass& scene) {
  const auto copy = [](const LockedScene& self) {
    return LockedScene::fromState(self.state(true));
  };
  scene.def("snapshot", copy, docs::kSnapshot)
      .def("__copy__", copy)
      .def(
          "__deepcopy__", [copy](const LockedScene& self, const py::dict&) { return copy(self); },
          "memo"_a)
      .def(py::pickle([](const LockedScene& self) { return self.state(false); },
                      &LockedScene::fromState));
}

}  // namespace adaptive_bvh::python
