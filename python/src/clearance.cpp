#include <array>
#include <limits>
#include <optional>
#include <set>
#include <string>

#include <pybind11/stl.h>

#include "adaptive_bvh/motion_clearance.h"
#include "bind.h"
#include "ignored.h"
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
    R"(The times at which two bodies are nearer than `distance`: (K, 2) float64, begins and ends.
Outside of these intervals the bodies are at least `distance` apart; inside, at most `distance` +
`tolerance`.

first, second: Motion or BodyMotion.)";

constexpr const char* kSelfLeastDistance =
    R"(The least distance of a mesh to itself, over its motion or as it is: a MotionClearance.

mesh: Motion, BodyMotion of a mesh, or DeformableMesh.
ignored: a SurfaceNeighbourhood of the mesh, Ignored, (K, 2) integers in any order, or None: pairs of
    triangles that do not count. Those with a common vertex never count.
tolerance: a length.)";

constexpr const char* kSelfIntervalsBelow =
    R"(The times at which a mesh is nearer to itself than `distance`: (K, 2) float64, as of
intervals_below. Arguments as of self_least_distance.)";
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
  BodyMotion motion() const {
    if (motion_) return BodyMotion(motion_->motion(), path_);
    if (mesh_) return BodyMotion(mesh_->mesh(), poses_.tf1, poses_.tf2, path_);
    return BodyMotion(shape_->geometry(), poses_.tf1, poses_.tf2, path_);
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

py::object intervalsOf(const py::object& first, const py::object& second, double distance,
                       double tolerance) {
  const MovingObject a = MovingObject::from(first), b = MovingObject::from(second);
  std::vector<MotionInterval> intervals;
  withMeshes([&] { intervalsBelow(a.motion(), b.motion(), distance, tolerance, intervals); },
             {a.mesh(), b.mesh()});
  return rowsOf(intervals);
}

MotionClearance selfLeastOf(const py::object& mesh, const py::object& ignored, double tolerance) {
  const MovingObject moving = MovingObject::from(mesh);
  const IgnoredArgument out(ignored, IgnoredArgument::Triangles, true);
  return withMeshes([&] { return selfLeastDistance(moving.motion(), out.get(), tolerance); },
                    {moving.mesh()});
}

py::object selfIntervalsOf(const py::object& mesh, const py::object& ignored, double distance,
                           double tolerance) {
  const MovingObject moving = MovingObject::from(mesh);
  const IgnoredArgument out(ignored, IgnoredArgument::Triangles, true);
  std::vector<MotionInterval> intervals;
  withMeshes(
      [&] { selfIntervalsBelow(moving.motion(), out.get(), distance, tolerance, intervals); },
      {moving.mesh()});
  return rowsOf(intervals);
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

}  // namespace

void bindMotions(py::module_& module) {
  py::class_<MovingObject>(module, "BodyMotion", docs::kBodyMotion)
      .def(py::init<const py::object&, const py::object&, const py::object&, const std::string&>(),
           "body"_a, "start_tf"_a = py::none(), "end_tf"_a = py::none(), "path"_a = "straight");
  bindMotionClearance(module);
  module.def("least_distance", &leastOf, "first"_a, "second"_a, "tolerance"_a,
             "limit"_a = std::numeric_limits<double>::infinity(), docs::kLeastDistance);
  module.def("intervals_below", &intervalsOf, "first"_a, "second"_a, "distance"_a, "tolerance"_a,
             docs::kIntervalsBelow);
  module.def("self_least_distance", &selfLeastOf, "mesh"_a, "ignored"_a, "tolerance"_a,
             docs::kSelfLeastDistance);
  module.def("self_intervals_below", &selfIntervalsOf, "mesh"_a, "ignored"_a, "distance"_a,
             "tolerance"_a, docs::kSelfIntervalsBelow);
}

}  // namespace adaptive_bvh::python
