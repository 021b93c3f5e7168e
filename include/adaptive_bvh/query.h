#pragma once

#include <cstddef>

#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

namespace adaptive_bvh {

namespace detail {

/// Runs the recorded query where there is one for the pair, and says so. Compiled into the library
/// for float and double.
template <typename S>
bool recordedDistance(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                      const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                      const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                      S& distance);

template <typename S>
bool recordedCollide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                     const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                     const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                     std::size_t& contacts);

}  // namespace detail

/// FCL's distance and collide, with FCL's signatures and answers, faster, and leaving evidence in
/// the adaptive models they meet: which volumes were in the way of an answer (thesis 4.4.2, 4.4.3).
/// The next update refits by that evidence. It works without it, but then it has to treat every
/// node as if it had been visited.
///
/// Recorded pairs: an AdaptiveBVHModel with another model of fcl::RSS, adaptive or not, with a
/// primitive shape, or with an octree (but for signed distances and costs), in either order. Any
/// other pair is handed to FCL.
///
/// `distance` of two adaptive models with Propagation::Boxes is found by their boxes
/// (docs/bounds.md), starting from the pair of triangles that was nearest in the last query of the
/// two. It is the least of all distances of two triangles as FCL computes them, up to rounding; of
/// several nearest pairs another one may be named. Likewise with an octree, by FCL's solver on its
/// cells and the triangles. Everything else runs FCL's own traversal, and every field of the result
/// is what FCL computes on the same trees. Beyond FCL:
/// - `collide` of two meshes takes the oriented traversal, where fcl::collide copies both models on
///   every call and rebuilds the copy of one that is not at the identity. The contacts are the same
///   set; their order may differ.
/// - A model without triangles on either side of a recorded pair, and the distance to a plane or a
///   half-space, throw std::invalid_argument; FCL crashes there.
///
/// S is float or double. Thread-safe on shared models, like FCL's; see AdaptiveBVHModel. As in FCL
/// the result is not cleared first: an older, smaller distance in it is kept.
template <typename S>
S distance(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
           const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
           const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  S recorded;
  if (detail::recordedDistance(o1, tf1, o2, tf2, request, result, recorded)) return recorded;
  return fcl::distance(o1, tf1, o2, tf2, request, result);
}

template <typename S>
S distance(const fcl::CollisionObject<S>* o1, const fcl::CollisionObject<S>* o2,
           const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  return adaptive_bvh::distance(o1->collisionGeometry().get(), o1->getTransform(),
                                o2->collisionGeometry().get(), o2->getTransform(), request, result);
}

/// Returns the number of contacts. Leaves evidence for test B only: an overlap test tells no
/// distances.
template <typename S>
std::size_t collide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                    const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                    const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  std::size_t recorded;
  if (detail::recordedCollide(o1, tf1, o2, tf2, request, result, recorded)) return recorded;
  return fcl::collide(o1, tf1, o2, tf2, request, result);
}

template <typename S>
std::size_t collide(const fcl::CollisionObject<S>* o1, const fcl::CollisionObject<S>* o2,
                    const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  return adaptive_bvh::collide(o1->collisionGeometry().get(), o1->getTransform(),
                               o2->collisionGeometry().get(), o2->getTransform(), request, result);
}

}  // namespace adaptive_bvh
