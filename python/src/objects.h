#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include <fcl/geometry/collision_geometry.h>

#include "locked_mesh.h"
#include "pose.h"
#include "shapes.h"

namespace adaptive_bvh::python {

/// What a query of two objects is given: two meshes, or a mesh and a shape.
struct Objects {
  const LockedMesh* first = nullptr;   ///< a mesh
  const LockedMesh* second = nullptr;  ///< another, or null
  const Shape* shape = nullptr;        ///< or this
  bool is_swapped = false;             ///< the shape was passed before the mesh
  fcl::Transform3d tf1, tf2;           ///< poses of the mesh, and of the mesh or shape
};

/// Throws py::type_error for other pairs, and as poseFrom. Needs the GIL.
Objects objectsFrom(const py::object& o1, const py::object& o2, const py::object& tf1,
                    const py::object& tf2);

/// Two poses, read before the GIL is released.
struct Poses {
  Poses(const py::object& first, const py::object& second, const char* name1, const char* name2)
      : tf1(poseFrom(first, name1)), tf2(poseFrom(second, name2)) {}
  fcl::Transform3d tf1, tf2;
};

/// A pose as numbers of type S. Throws std::invalid_argument when it is beyond the numbers that the
/// meshes may have.
template <typename S>
fcl::Transform3<S> poseAs(const fcl::Transform3d& pose) {
  requireNear(pose, sizeof(S) == sizeof(double));
  return pose.cast<S>();
}

/// Runs `f(geometry1, tf1, geometry2, tf2)` on FCL's objects, the mesh first, without the GIL and
/// with locks.
template <typename F>
void queryObjects(const Objects& o, const F& f) {
  const auto run = [&](const auto& first, const auto& second) {
    using S = ScalarOf<std::decay_t<decltype(first)>>;
    using Geometry = const fcl::CollisionGeometry<S>*;
    f(Geometry(&first), poseAs<S>(o.tf1), Geometry(second), poseAs<S>(o.tf2));
  };
  if (o.second) {
    LockedMesh::queryPair(*o.first, *o.second, [&](const auto& a, const auto& b) { run(a, &b); });
  } else {
    o.first->query([&](const auto& mesh) {
      run(mesh, o.shape->geometry<ScalarOf<std::decay_t<decltype(mesh)>>>());
    });
  }
}

}  // namespace adaptive_bvh::python
