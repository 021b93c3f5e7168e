#pragma once

#include <cstddef>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>

#include "adaptive_bvh/adaptive_bvh_model.h"

namespace adaptive_bvh {

/// Which pairs of triangles a self-collision leaves out: neighbours always touch. Vertices are
/// compared by index, so a mesh that was built triangle by triangle (addTriangle) has no
/// neighbours; join its vertices first, as `loadMesh` does. A vertex that a triangle repeats counts
/// once.
enum class NeighbourFilter {
  SharedVertex,  ///< leaves out pairs with a vertex in common
  SharedEdge,    ///< leaves out pairs with two vertices in common
  None,          ///< leaves out no pair
};

/// Where a deforming mesh touches itself (thesis chapter VI, future work): one contact for every
/// pair of its triangles that intersect, except the neighbours that `filter` leaves out. `b1` and
/// `b2` are the two triangles, the smaller index first; both objects of a contact are the model.
/// Which triangles intersect is decided as in adaptive_bvh::collide, whatever `enable_contact` is,
/// and always with the smaller index as the first of the two: where triangles barely touch FCL's
/// verdict depends on that. So it does not depend on the tree. With `enable_contact` a contact has
/// FCL's normal and depth and the first of FCL's points (FCL may compute two for a pair; `collide`
/// gives both); query.h describes the contacts of thin triangles. Without it these fields are NaN.
/// `tf` places the model: positions and normals are in the world.
///
/// Stops when it has `request.num_max_contacts` pairs, which FCL sets to 1: request more to find
/// all. Searches the boxes beside FCL's volumes when the model has them (docs/bounds.md), else runs
/// FCL's self-collision recursion. Either way the nodes that it went below are recorded for test B,
/// and for test D in FCL's recursion. Returns the number of contacts in the result, which is not
/// cleared first. Thread-safe on shared models; on several threads itself where
/// AdaptiveBVHModel::setQueryThreads says so.
///
/// Throws std::invalid_argument when the model has no triangles or is not built, or `tf` is not a
/// rigid motion.
template <typename BV>
std::size_t selfCollide(const AdaptiveBVHModel<BV>& model,
                        const fcl::Transform3<typename BV::S>& tf,
                        const fcl::CollisionRequest<typename BV::S>& request,
                        fcl::CollisionResult<typename BV::S>& result,
                        NeighbourFilter filter = NeighbourFilter::SharedVertex);

/// As above, in the model's own frame.
template <typename BV>
std::size_t selfCollide(const AdaptiveBVHModel<BV>& model,
                        const fcl::CollisionRequest<typename BV::S>& request,
                        fcl::CollisionResult<typename BV::S>& result,
                        NeighbourFilter filter = NeighbourFilter::SharedVertex) {
  return selfCollide(model,
                     fcl::Transform3<typename BV::S>(fcl::Transform3<typename BV::S>::Identity()),
                     request, result, filter);
}

}  // namespace adaptive_bvh
