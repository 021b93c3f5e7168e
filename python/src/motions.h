#pragma once

#include <memory>
#include <string>
#include <vector>

#include "adaptive_bvh/motion_clearance.h"
#include "arrays.h"
#include "bound.h"
#include "locked_mesh.h"
#include "pose.h"

namespace adaptive_bvh::python {

/// "straight" or "screw". Throws py::value_error on other names.
FramePath framePath(const std::string& name);

/// Python's Motion: a mesh, and copies of its positions at two times.
class MeshMotion : public Bound {
 public:
  /// Each of `start` and `end` may be None: the mesh's positions before and at present. Throws as
  /// Rows and poseFrom, and py::value_error when a number of positions is not that of the
  /// vertices or there are none before.
  MeshMotion(const LockedMesh& mesh, const py::object& start, const py::object& end,
             const py::object& start_tf, const py::object& end_tf)
      : mesh_(mesh.shared_from_this()), poses_(start_tf, end_tf, "start_tf", "end_tf") {
    mesh_->query([&](const Mesh& m) {  // both of one frame
      if (start.is_none()) start_ = m.previousVertices();
      if (end.is_none()) end_ = m.vertices();
    });
    if (start.is_none() && start_.empty())
      throw py::value_error(
          "start is missing: the last update was not update_two_frames, so the mesh has no "
          "positions before");
    copy(start, "start", start_);
    copy(end, "end", end_);
  }

  const LockedMesh& mesh() const { return *mesh_; }

  /// For the library, while the mesh is locked. Refers to this object.
  Motion motion() const { return {mesh_->mesh(), start_, end_, poses_.tf1, poses_.tf2}; }

 private:
  void copy(const py::object& positions, const char* name, std::vector<fcl::Vector3d>& copied) {
    if (positions.is_none()) return;
    const Rows rows(positions, name);
    requireRows(rows.array(), mesh_->numVertices(), name);
    copied.assign(rows.begin(), rows.end());
  }

  std::shared_ptr<const LockedMesh> mesh_;
  std::vector<fcl::Vector3d> start_, end_;
  Poses poses_;
};

/// Runs `f(motion)` on the library's motion, without the GIL; likewise `f(first, second)`.
template <typename F>
auto queryMotions(const F& f, const MeshMotion& motion) {
  return motion.mesh().query([&](const Mesh&) { return f(motion.motion()); });
}
template <typename F>
auto queryMotions(const F& f, const MeshMotion& first, const MeshMotion& second) {
  return queryPair(first.mesh(), second.mesh(),
                   [&](const Mesh&, const Mesh&) { return f(first.motion(), second.motion()); });
}

}  // namespace adaptive_bvh::python
