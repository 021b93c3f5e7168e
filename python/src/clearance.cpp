#include <array>
#include <limits>
#include <optional>
#include <set>
#include <string>

#include <pybind11/stl.h>

#include "adaptive_bvh/motion_clearance.h"
#include "bind.h"
#include "features.h"
#include "motions.h"
#include "objects.h"
#include "results.h"

// Clearance over a whole motion.
namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kBodyMotion =
    R"(How a mesh or a shape moves from t = 0 to 1.

body: a DeformableMesh with its present positions, a shape, or a Motion, which has its own poses.
start_tf, end_tf: poses that place the body in the world at both times.
path: 'straight': every point on a straight line, so a body that turns shrinks in between. 'screw':
    turning about an axis by at most half a turn, and moving along the axis.)";

constexpr const char* kLeastDistance =
    R"(The least distance of two bodies over their motions, as bounds that hold at every time: a
MotionClearance. If the bodies meet, it is 0 with the time of the first impact.

first, second: Motion or BodyMotion. Shapes are filled; of meshes the surfaces count.
tolerance: a length, the largest difference of both bounds.
limit: a length. Bodies that are at least so far apart at all times are not searched further: lower
    is the limit, and upper infinite.)";

constexpr const char* kIntervalsBelow =
    R"(The times at which two bodies are nearer than `clearance`: (K, 2) float64, begins and ends.
Outside of these intervals the bodies are at least `clearance` apart; inside, at most `clearance` +
`tolerance`.

first, second: Motion or BodyMotion.)";

constexpr const char* kLeastSelfDistance =
    R"(The least distance of a mesh to itself, over its motion or as it is: a MotionClearance.

mesh: Motion, BodyMotion of a mesh, or DeformableMesh.
left_out: a SurfaceNeighbourhood of the mesh: pairs of triangles that do not count.
tolerance: a length.
ignored: further pairs of triangles to leave out, (M, 2) integers in any order, or None.)";

constexpr const char* kSelfIntervalsBelow =
    R"(The times at which a mesh is nearer to itself than `clearance`: (K, 2) float64, as of
intervals_below. Arguments as of least_self_distance.)";

constexpr const char* kNeighbourhood =
    R"(Pairs of triangles of one mesh that do not count, for least_self_distance. Triangles with a
common vertex never count. For this mesh and its copies, at all positions.)";

constexpr const char* kByDistance =
    R"(The triangles at most `distance` away along the surface: by the shortest path along edges, at
the present positions.)";
}  // namespace docs

FramePath framePath(const std::string& name) {
  if (name == "straight") return FramePath::Straight;
  if (name == "screw") return FramePath::Screw;
  throw py::value_error("path is '" + name + "'; 'straight' or 'screw' is needed");
}

namespace {

/// Python's BodyMotion. Keeps the body alive.
class MovingObject : public Bound {
 public:
  /// Throws py::type_error on other bodies, py::value_error on poses beside those of a Motion.
  MovingObject(const py::object& body, const py::object& start_tf, const py::object& end_tf,
               const std::string& path)
      : body_(body), poses_(start_tf, end_tf, "start_tf", "end_tf"), path_(framePath(path)) {
    if (py::isinstance<MeshMotion>(body)) {
      motion_ = &body.cast<const MeshMotion&>();
      if (!start_tf.is_none() || !end_tf.is_none())
        throw py::value_error("start_tf and end_tf are those of the Motion");
      return;
    }
    mesh_ = asMesh(body);
    shape_ = asShape(body);
    if (!mesh_ && !shape_)
      throw py::type_error("body is " + typeNameOf(body) +
                           "; a DeformableMesh, a shape or a Motion is needed" + howToMesh(body));
  }
  /// A Motion, or a BodyMotion that is copied, or a mesh that stands still.
  static MovingObject from(const py::object& object) {
    if (py::isinstance<MovingObject>(object)) return object.cast<const MovingObject&>();
    return MovingObject(object, py::none(), py::none(), "straight");
  }

  /// The mesh, or null.
  const LockedMesh* mesh() const { return motion_ ? &motion_->mesh() : mesh_; }
  /// For the library, while the mesh is locked. Refers to this object.
  BodyMotion<double> motion() const {
    if (motion_) return BodyMotion<double>(motion_->motion(), path_);
    if (mesh_) return BodyMotion<double>(mesh_->mesh(), poses_.tf1, poses_.tf2, path_);
    return BodyMotion<double>(shape_->geometry(), poses_.tf1, poses_.tf2, path_);
  }

 private:
  py::object body_;
  const MeshMotion* motion_ = nullptr;
  const LockedMesh* mesh_ = nullptr;
  const Shape* shape_ = nullptr;
  Poses poses_;
  FramePath path_;
};

/// Runs f() without the GIL, with the locks of the meshes.
template <typename F>
auto withMeshes(const F& f, std::set<const LockedMesh*> meshes) {
  meshes.erase(nullptr);
  const py::gil_scoped_release nogil;
  const auto locks = LockedMesh::shareAll(meshes);
  return f();
}

MotionClearance leastOf(const py::object& first, const py::object& second, double tolerance,
                        double limit) {
  const MovingObject a = MovingObject::from(first), b = MovingObject::from(second);
  return withMeshes([&] { return leastDistance(a.motion(), b.motion(), tolerance, limit); },
                    {a.mesh(), b.mesh()});
}

/// Intervals as rows.
py::object rowsOf(const std::vector<MotionInterval>& intervals) {
  std::vector<std::array<double, 2>> rows;
  for (const MotionInterval& interval : intervals) rows.push_back({interval.begin, interval.end});
  return adopt(std::move(rows));
}

py::object intervalsOf(const py::object& first, const py::object& second, double clearance,
                       double tolerance) {
  const MovingObject a = MovingObject::from(first), b = MovingObject::from(second);
  std::vector<MotionInterval> intervals;
  withMeshes([&] { intervalsBelow(a.motion(), b.motion(), clearance, tolerance, intervals); },
             {a.mesh(), b.mesh()});
  return rowsOf(intervals);
}

/// Python's SurfaceNeighbourhood.
struct Neighbours : Bound {
  explicit Neighbours(SurfaceNeighbourhood&& found) : pairs(std::move(found)) {}
  SurfaceNeighbourhood pairs;
};

/// Pairs of triangles to leave out of a query of one mesh.
struct LeftOut {
  explicit LeftOut(const py::object& ignored) : list(ignoredFrom(ignored, "ignored", true)) {
    if (!list.empty()) pairs.list = &list;
  }
  LeftOut(const LeftOut&) = delete;
  LeftOut& operator=(const LeftOut&) = delete;

  const std::vector<FeaturePair> list;
  IgnoredPairs pairs;
};

MotionClearance leastSelfOf(const py::object& mesh, const Neighbours& left_out, double tolerance,
                            const py::object& ignored) {
  const MovingObject moving = MovingObject::from(mesh);
  const LeftOut out(ignored);
  return withMeshes(
      [&] { return leastSelfDistance(moving.motion(), left_out.pairs, tolerance, out.pairs); },
      {moving.mesh()});
}

py::object selfIntervalsOf(const py::object& mesh, const Neighbours& left_out, double clearance,
                           double tolerance, const py::object& ignored) {
  const MovingObject moving = MovingObject::from(mesh);
  const LeftOut out(ignored);
  std::vector<MotionInterval> intervals;
  withMeshes(
      [&] {
        selfIntervalsBelow(moving.motion(), left_out.pairs, clearance, tolerance, intervals,
                           out.pairs);
      },
      {moving.mesh()});
  return rowsOf(intervals);
}

/// Makes a SurfaceNeighbourhood of a mesh by f(mesh).
template <typename F>
Neighbours neighboursBy(const LockedMesh& mesh, const F& f) {
  return Neighbours(mesh.query([&](const Mesh& m) { return f(m); }));
}

void bindMotionClearance(py::module_& module) {
  using C = MotionClearance;
  ResultClass<C> result(module, "MotionClearance", "The least distance over a motion.");
  result
      .attribute("lower", &C::lower,
                 "A length: at all times the bodies are at least so far apart. 0 if they meet.")
      .attribute("upper", &C::upper,
                 "A length: at `time` they are at most so far apart. 0 if they meet; infinite if "
                 "there is no pair of parts, or none within the limit.")
      .attribute("time", &C::time, "0 to 1: when; if they meet, that of the first impact.")
      .attribute("triangles", &C::triangles, "(2,) int32: those that are so near; -1 of a shape.")
      .attribute("points", &C::points, "(2, 3) float64: nearest points at `time`, in the world.");
  (*result).def_property_readonly("meets", &C::meet, "Whether the bodies meet.");
}

void bindNeighbourhood(py::module_& module) {
  py::class_<Neighbours>(module, "SurfaceNeighbourhood", docs::kNeighbourhood)
      .def(py::init([](const LockedMesh& mesh) {
             return neighboursBy(mesh, [](const Mesh& m) { return SurfaceNeighbourhood(m); });
           }),
           "mesh"_a, "Only triangles with a common vertex.")
      .def_static(
          "by_rings",
          [](const LockedMesh& mesh, unsigned rings) {
            return neighboursBy(
                mesh, [&](const Mesh& m) { return SurfaceNeighbourhood::byRings(m, rings); });
          },
          "mesh"_a, "rings"_a,
          "The triangles within so many steps to a triangle with a common vertex.")
      .def_static(
          "by_distance",
          [](const LockedMesh& mesh, double distance) {
            return neighboursBy(
                mesh, [&](const Mesh& m) { return SurfaceNeighbourhood::byDistance(m, distance); });
          },
          "mesh"_a, "distance"_a, docs::kByDistance)
      .def_static(
          "by_labels",
          [](const LockedMesh& mesh, const py::object& labels, const std::string& label_rule) {
            const Labels of_faces(labels, label_rule, mesh);
            return neighboursBy(mesh, [&](const Mesh& m) {
              return SurfaceNeighbourhood::byLabels(m, of_faces.labels(), of_faces.rule());
            });
          },
          "mesh"_a, "labels"_a, "label_rule"_a,
          "By a label for each triangle: 'between' lets pairs count whose labels differ, 'within' "
          "those whose labels are equal.")
      .def(
          "contains",
          [](const Neighbours& self, unsigned first, unsigned second) {
            return self.pairs.contains(first, second);
          },
          "first"_a, "second"_a, "Whether two triangles do not count.");
}

}  // namespace

void bindMotions(py::module_& module) {
  py::class_<MovingObject>(module, "BodyMotion", docs::kBodyMotion)
      .def(py::init<const py::object&, const py::object&, const py::object&, const std::string&>(),
           "body"_a, "start_tf"_a = py::none(), "end_tf"_a = py::none(), "path"_a = "straight");
  bindMotionClearance(module);
  bindNeighbourhood(module);
  module.def("least_distance", &leastOf, "first"_a, "second"_a, "tolerance"_a,
             "limit"_a = std::numeric_limits<double>::infinity(), docs::kLeastDistance);
  module.def("intervals_below", &intervalsOf, "first"_a, "second"_a, "clearance"_a, "tolerance"_a,
             docs::kIntervalsBelow);
  module.def("least_self_distance", &leastSelfOf, "mesh"_a, "left_out"_a, "tolerance"_a,
             "ignored"_a = py::none(), docs::kLeastSelfDistance);
  module.def("self_intervals_below", &selfIntervalsOf, "mesh"_a, "left_out"_a, "clearance"_a,
             "tolerance"_a, "ignored"_a = py::none(), docs::kSelfIntervalsBelow);
}

}  // namespace adaptive_bvh::python
