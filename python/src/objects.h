#pragma once

#include <fcl/geometry/collision_geometry.h>

#include "locked_mesh.h"
#include "pose.h"
#include "shapes.h"
#include "wrong_type.h"

namespace adaptive_bvh::python {

/// Null of other objects.
const LockedMesh* asMesh(const py::object& object);
const Shape* asShape(const py::object& object);

/// Runs `f(mesh, shape)` on a C++ mesh and FCL's shape, as queryPair of two meshes.
template <typename F>
auto queryPair(const LockedMesh& mesh, const Shape& shape, const F& f) {
  return mesh.query([&](const Mesh& m) { return f(m, shape.geometry()); });
}

/// What a query of two objects is given: two meshes, or a mesh and a shape.
struct Objects {
  const LockedMesh* first = nullptr;   ///< a mesh
  const LockedMesh* second = nullptr;  ///< another, or null
  const Shape* shape = nullptr;        ///< or this
  bool is_swapped = false;             ///< the shape was passed before the mesh
  fcl::Transform3d tf1, tf2;           ///< poses of the mesh, and of the mesh or shape

  /// Throws py::type_error for other pairs, and as poseFrom. Needs the GIL.
  Objects(const py::object& o1, const py::object& o2, const py::object& pose1,
          const py::object& pose2);

  /// Runs `f(geometry1, tf1, geometry2, tf2)` on FCL's objects, the mesh first, without the GIL and
  /// with locks.
  template <typename F>
  void query(const F& f) const {
    const auto run = [&](const Mesh& mesh, const auto& other) { f(&mesh, tf1, &other, tf2); };
    if (second)
      queryPair(*first, *second, run);
    else
      queryPair(*first, *shape, run);
  }
};

}  // namespace adaptive_bvh::python
