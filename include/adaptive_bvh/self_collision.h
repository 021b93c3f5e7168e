#pragma once

#include <cstddef>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

/// Which pairs of triangles a self-collision leaves out: neighbours always touch. Vertices are
/// compared by index, so a mesh that was built triangle by triangle (addTriangle) has no
/// neighbours: join its vertices first (weldVertices). A vertex that a triangle repeats counts
/// once.
enum class NeighbourFilter {
  SharedVertex,  ///< leaves out pairs with a vertex in common
  SharedEdge,    ///< leaves out pairs with two vertices in common
  None,          ///< leaves out no pair
  /// Leaves out pairs with vertices in common whose triangles have no other common point. So
  /// neighbours count if they are folded over each other, or cross beyond the shared corner or
  /// edge. That is decided without any error. Triangles with the same three vertices count. A
  /// triangle without area does not count with its neighbours. Not for pairsWithin.
  BeyondShared,
};

/// Finds the contacts of a deforming mesh with itself (thesis chapter VI, future work): one contact
/// for every pair of its triangles that intersect, except the neighbours that `filter` leaves out
/// and the pairs in `ignored`. `b1` and `b2` are the two triangles, the smaller index first; both
/// objects of a contact are the mesh. Which triangles intersect is decided as in
/// adaptive_bvh::collide, and does not depend on `enable_contact`. With `enable_contact` a contact
/// has the normal and depth of `collide` and the first of its points (`collide` may return two for
/// a pair); query.h describes them. Without it these fields are NaN. `tf` places the mesh:
/// positions and normals are in the world.
///
/// Stops at `request.num_max_contacts` pairs. FCL's default is 1: request more to find all. Returns
/// the number of contacts in the result, which is not cleared first. Thread-safe on shared meshes;
/// runs on several threads if DeformableMesh::setQueryThreads allows it.
///
/// Throws std::invalid_argument if `tf` is not a rigid motion, or the list of `ignored` is not as
/// IgnoredPairs says.
template <typename S>
std::size_t selfCollide(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                        const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                        NeighbourFilter filter = NeighbourFilter::SharedVertex,
                        const IgnoredPairs& ignored = IgnoredPairs());

/// Finds the contacts of a mesh with itself, in its own frame.
template <typename S>
std::size_t selfCollide(const DeformableMesh<S>& mesh, const fcl::CollisionRequest<S>& request,
                        fcl::CollisionResult<S>& result,
                        NeighbourFilter filter = NeighbourFilter::SharedVertex,
                        const IgnoredPairs& ignored = IgnoredPairs()) {
  return selfCollide(mesh, fcl::Transform3<S>(fcl::Transform3<S>::Identity()), request, result,
                     filter, ignored);
}

}  // namespace adaptive_bvh
