#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "adaptive_bvh/motion_clearance.h"
#include "bound.h"
#include "locked_mesh.h"
#include "pose.h"
#include "shapes.h"

namespace adaptive_bvh::python {

/// "straight" or "screw". Throws py::value_error on other names.
FramePath framePath(const std::string& name);

/// Python's Motion: a mesh and copies of its positions at two times, or a body that keeps its
/// shape. Keeps the body alive. A copy shares the positions.
class MovingObject : public Bound {
 public:
  /// Each of `start` and `end` may be None: the mesh's positions before and at present. Throws as
  /// Rows, poseFrom and framePath, and py::value_error when a number of positions is not that of
  /// the vertices or there are none before.
  MovingObject(const LockedMesh& mesh, const py::object& start, const py::object& end,
               const py::object& start_tf, const py::object& end_tf, const std::string& path);
  /// A mesh with its present positions, or a shape. Throws py::type_error on other bodies.
  static MovingObject rigid(const py::object& body, const py::object& start_tf,
                            const py::object& end_tf, const std::string& path);
  /// A copy of a Motion, or a body that stands still.
  static MovingObject from(const py::object& object);

  /// The mesh, or null.
  const LockedMesh* mesh() const { return mesh_.get(); }
  /// The mesh. Throws py::value_error if the body is a shape.
  const LockedMesh& meshWithFeatures() const;
  /// For the library, while the mesh is locked. Refers to this object.
  Motion motion() const;

 private:
  MovingObject(const py::object& start_tf, const py::object& end_tf, const std::string& path)
      : poses_(start_tf, end_tf, "start_tf", "end_tf"), path_(framePath(path)) {}

  std::shared_ptr<const LockedMesh> mesh_;
  py::object shape_object_;
  const Shape* shape_ = nullptr;
  std::shared_ptr<const Motion::Positions> positions_;  ///< null for the present ones
  Poses poses_;
  FramePath path_;
};

/// Runs f() without the GIL, with the locks of the meshes, some of which may be null.
template <typename F>
auto withMeshes(const F& f, std::set<const LockedMesh*> meshes) {
  meshes.erase(nullptr);
  const py::gil_scoped_release nogil;
  const auto locks = LockedMesh::shareAll(meshes);
  return f();
}

/// Runs `f(motions...)` on the library's motions, without the GIL.
template <typename F, typename... Motions>
auto queryMotions(const F& f, const Motions&... motions) {
  return withMeshes([&] { return f(motions.motion()...); }, {motions.mesh()...});
}

}  // namespace adaptive_bvh::python
