#include <array>
#include <limits>
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "adaptive_bvh/motion_clearance.h"
#include "arrays.h"
#include "bind.h"
#include "ignored.h"
#include "motions.h"
#include "objects.h"
#include "results.h"

// Clearance over a whole motion.
namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kLeastDistance =
    R"(The least distance of two bodies over their motions, as bounds that hold at every time: a
MotionClearance. If the bodies meet, it is 0 with the time of the first impact.

first, second: Motion, or a body that stands still. Shapes are filled; of meshes the surfaces count.
tolerance: a length, the largest difference of both bounds.
limit: a length. Bodies that are at least so far apart at all times are not searched further: lower
    is the limit, and upper infinite.)";

constexpr const char* kIntervalsBelow =
    R"(The times at which two bodies are nearer than `distance`: (K, 2) float64, begins and ends.
Outside of these intervals the bodies are at least `distance` apart; inside, at most `distance` +
`tolerance`.

first, second: Motion, or a body that stands still.)";

constexpr const char* kSelfLeastDistance =
    R"(The least distance of a mesh to itself, over its motion or as it is: a MotionClearance.

mesh: Motion of a mesh, or DeformableMesh.
ignored: a SurfaceNeighbourhood of the mesh, Ignored, (K, 2) integers in any order, or None: pairs of
    triangles that do not count. Those with a common vertex never count.
tolerance: a length.)";

constexpr const char* kSelfIntervalsBelow =
    R"(The times at which a mesh is nearer to itself than `distance`: (K, 2) float64, as of
intervals_below. Arguments as of self_least_distance.)";
}  // namespace docs

FramePath framePath(const std::string& name) {
  return named<FramePath>(name, "path",
                          {{"straight", FramePath::Straight}, {"screw", FramePath::Screw}});
}

MovingObject::MovingObject(const LockedMesh& mesh, const py::object& start, const py::object& end,
                           const py::object& start_tf, const py::object& end_tf,
                           const std::string& path)
    : MovingObject(start_tf, end_tf, path) {
  mesh_ = mesh.shared_from_this();
  Motion::Positions positions;
  mesh_->query([&](const Mesh& m) {  // both of one frame
    if (start.is_none()) positions[0] = m.previousVertices();
    if (end.is_none()) positions[1] = m.vertices();
  });
  if (start.is_none() && positions[0].empty())
    throw py::value_error(
        "start is missing: the last update was not update_two_frames, so the mesh has no "
        "positions before");
  const auto copy = [&](const py::object& given, const char* name, std::vector<fcl::Vector3d>& to) {
    if (given.is_none()) return;
    const Rows rows(given, name);
    requireRows(rows.array(), mesh_->numVertices(), name);
    to.assign(rows.begin(), rows.end());
  };
  copy(start, "start", positions[0]);
  copy(end, "end", positions[1]);
  positions_ = std::make_shared<const Motion::Positions>(std::move(positions));
}

MovingObject MovingObject::rigid(const py::object& body, const py::object& start_tf,
                                 const py::object& end_tf, const std::string& path) {
  MovingObject moving(start_tf, end_tf, path);
  if (const LockedMesh* const mesh = asMesh(body)) {
    moving.mesh_ = mesh->shared_from_this();
    return moving;
  }
  moving.shape_object_ = body;
  moving.shape_ = asShape(body);
  if (!moving.shape_)
    throw py::type_error("body is " + typeNameOf(body) + "; a DeformableMesh or a shape is needed" +
                         howToMesh(body));
  return moving;
}

MovingObject MovingObject::from(const py::object& object) {
  if (py::isinstance<MovingObject>(object)) return object.cast<const MovingObject&>();
  return rigid(object, py::none(), py::none(), "straight");
}

const LockedMesh& MovingObject::meshWithFeatures() const {
  if (!mesh_)
    throw py::value_error("a Motion of a shape, which has no features; least_distance takes it");
  return *mesh_;
}

Motion MovingObject::motion() const {
  if (positions_) return {mesh_->mesh(), positions_, poses_.tf1, poses_.tf2, path_};
  return mesh_ ? Motion::rigid(mesh_->mesh(), poses_.tf1, poses_.tf2, path_)
               : Motion::rigid(shape_->geometry(), poses_.tf1, poses_.tf2, path_);
}

namespace {

MotionClearance leastOf(const py::object& first, const py::object& second, double tolerance,
                        double limit) {
  return queryMotions(
      [&](const Motion& a, const Motion& b) { return leastDistance(a, b, tolerance, limit); },
      MovingObject::from(first), MovingObject::from(second));
}

/// Intervals as rows.
py::object rowsOf(const std::vector<MotionInterval>& intervals) {
  std::vector<std::array<double, 2>> rows;
  for (const MotionInterval& interval : intervals) rows.push_back({interval.begin, interval.end});
  return adopt(std::move(rows));
}

py::object intervalsOf(const py::object& first, const py::object& second, double distance,
                       double tolerance) {
  std::vector<MotionInterval> intervals;
  queryMotions([&](const Motion& a,
                   const Motion& b) { intervalsBelow(a, b, distance, tolerance, intervals); },
               MovingObject::from(first), MovingObject::from(second));
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
      .attribute("elements", &C::elements,
                 "(2,) int32: the triangles or cells that are so near; -1 of a shape.")
      .attribute("points", &C::points, "(2, 3) float64: nearest points at `time`, in the world.");
  (*result).def_property_readonly("meets", &C::meet, "Whether the bodies meet.");
}

}  // namespace

void bindMotions(py::module_& module) {
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
