#pragma once

#include <memory>
#include <vector>

#include "adaptive_bvh/continuous_collision.h"
#include "arrays.h"
#include "locked_mesh.h"
#include "objects.h"

namespace adaptive_bvh::python {

/// Python's Motion: a mesh, and copies of its positions at two times.
class MeshMotion : public Bound {
 public:
  /// Each of `start` and `end` may be None: the mesh's positions before and at present. Throws as
  /// rowsFrom and poseFrom, and py::value_error when a number of positions is not that of the
  /// vertices or there are none before.
  MeshMotion(const LockedMesh& mesh, const py::object& start, const py::object& end,
             const py::object& start_tf, const py::object& end_tf);

  const LockedMesh& mesh() const { return *mesh_; }

  /// For the library. Refers to this object.
  template <typename S>
  Motion<S> of(const DeformableMesh<S>& mesh) const {
    const Positions<S>& positions = std::get<Positions<S>>(positions_);
    return Motion<S>(mesh, positions.start, positions.end, poseAs<S>(start_tf_),
                     poseAs<S>(end_tf_));
  }

 private:
  template <typename S>
  struct Positions {
    std::vector<Eigen::Matrix<S, 3, 1>> start, end;
  };

  template <typename S>
  Positions<S> positionsFrom(const py::object& start, const py::object& end) const;

  std::shared_ptr<const LockedMesh> mesh_;
  std::variant<Positions<double>, Positions<float>> positions_;
  fcl::Transform3d start_tf_, end_tf_;
};

/// Runs `f(motion)` on the library's motion, without the GIL; likewise `f(first, second)`.
template <typename F>
auto queryMotion(const MeshMotion& motion, const F& f) {
  return motion.mesh().query([&](const auto& mesh) { return f(motion.of(mesh)); });
}
template <typename F>
auto queryMotions(const MeshMotion& first, const MeshMotion& second, const F& f) {
  return LockedMesh::queryPair(first.mesh(), second.mesh(), [&](const auto& a, const auto& b) {
    return f(first.of(a), second.of(b));
  });
}

}  // namespace adaptive_bvh::python
