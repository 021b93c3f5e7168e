#pragma once

#include <memory>
#include <vector>

#include "adaptive_bvh/continuous_collision.h"
#include "locked_mesh.h"
#include "pose.h"

namespace adaptive_bvh::python {

/// Python's Motion: a mesh, and copies of its positions at two times.
class MeshMotion : public Bound {
 public:
  /// Each of `start` and `end` may be None: the mesh's positions before and at present. Throws as
  /// Rows and poseFrom, and py::value_error when a number of positions is not that of the
  /// vertices or there are none before.
  MeshMotion(const LockedMesh& mesh, const py::object& start, const py::object& end,
             const py::object& start_tf, const py::object& end_tf);

  const LockedMesh& mesh() const { return *mesh_; }

  /// For the library, while the mesh is locked. Refers to this object.
  Motion<double> motion() const { return {mesh_->mesh(), start_, end_, start_tf_, end_tf_}; }

 private:
  std::shared_ptr<const LockedMesh> mesh_;
  std::vector<fcl::Vector3d> start_, end_;
  fcl::Transform3d start_tf_, end_tf_;
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
