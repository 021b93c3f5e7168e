#pragma once

#include <cstddef>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

/// Finds the contacts of a deforming mesh with itself (thesis chapter VI, future work): one contact
/// for every pair of its triangles that intersect, without those that are ignored. `b1` and `b2`
/// are the two triangles, the smaller index first; both objects of a contact are the mesh. Which
/// triangles intersect is decided as in adaptive_bvh::collide, and does not depend on
/// `enable_contact`. With `enable_contact` a contact has the normal and depth of `collide` and the
/// first of its points (`collide` may return two for a pair); query.h describes them. Without it
/// these fields are NaN. `tf` places the mesh: positions and normals are in the world.
///
/// Stops at `request.num_max_contacts` pairs. FCL's default is 1: request more to find all. Returns
/// the number of contacts in the result, which is not cleared first. Thread-safe on shared meshes;
/// runs on several threads if DeformableMesh::setThreads allows it.
///
/// Throws std::invalid_argument if `tf` is not a rigid motion, or `ignored` is not as it says.
std::size_t selfCollide(const DeformableMesh& mesh, const fcl::Transform3d& tf,
                        const Ignored& ignored, const fcl::CollisionRequestd& request,
                        fcl::CollisionResultd& result);

/// Finds the contacts of a mesh with itself, in its own frame.
inline std::size_t selfCollide(const DeformableMesh& mesh, const Ignored& ignored,
                               const fcl::CollisionRequestd& request,
                               fcl::CollisionResultd& result) {
  return selfCollide(mesh, fcl::Transform3d(fcl::Transform3d::Identity()), ignored, request,
                     result);
}
/// Without triangles that have a vertex in common.
inline std::size_t selfCollide(const DeformableMesh& mesh, const fcl::CollisionRequestd& request,
                               fcl::CollisionResultd& result) {
  return selfCollide(mesh, Ignored(), request, result);
}

}  // namespace adaptive_bvh
