#pragma once

#include "query/depth_meshes.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Calls visit(triangle, x, target) for each component of a mesh that is inside of a closed one,
/// until `visit` returns false; x is the first corner of that triangle, in the frame of `around`.
/// The surfaces must not touch, so one vertex decides for its component. If they are nearer than
/// the rounding error of a transformed vertex, either answer is possible.
template <typename S, typename Visit>
void visitContained(const PlacedMesh<S>& mesh, const PlacedMesh<S>& around, const Visit& visit) {
  const RelativePlacement to_around(around.tf, mesh.tf);
  MeshTarget<S> target(around);
  if (target.isClear(to_around(mesh.geometry->aabb_center),
                     1.01 * double(mesh.geometry->aabb_radius)))
    return;
  for (const unsigned triangle : mesh.mesh.topology->components.firstTriangles()) {
    const fcl::Vector3d x = to_around(mesh.mesh.vertices[mesh.mesh.view().verticesOf(triangle)[0]]);
    if (target.isInside(x) && !visit(static_cast<int>(triangle), x, target)) return;
  }
}

/// Whether a component of a mesh is inside of a closed one. The surfaces must not touch.
template <typename S>
bool isContained(const PlacedMesh<S>& mesh, const PlacedMesh<S>& around) {
  bool is_contained = false;
  visitContained(mesh, around, [&](int, const fcl::Vector3d&, MeshTarget<S>&) {
    is_contained = true;
    return false;
  });
  return is_contained;
}

}  // namespace adaptive_bvh
