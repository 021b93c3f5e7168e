#pragma once

#include <cstddef>

#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

namespace adaptive_bvh {

namespace detail {

/// Runs the recorded query, if there is one for the pair; returns whether there is. Compiled into
/// the library for float and double.
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

/// Replaces what FCL left uninitialised.
template <typename S>
void finishDistance(const fcl::DistanceRequest<S>& request, S before,
                    fcl::DistanceResult<S>& result);
template <typename S>
void finishCollide(const fcl::CollisionRequest<S>& request, std::size_t before,
                   fcl::CollisionResult<S>& result);

}  // namespace detail

/// Home of `adaptive_bvh::distance` and `adaptive_bvh::collide`. They are kept out of the namespace
/// of AdaptiveBVHModel itself, where a call without a namespace would find them beside FCL's and be
/// ambiguous: `distance(&model, ...)` under `using namespace fcl` stays fcl::distance. (After
/// `using namespace adaptive_bvh` as well, write the namespace.)
namespace queries {

/// FCL's distance and collide, with FCL's signatures and answers, but faster. They record traversal
/// statistics in the adaptive models: which volumes were in the way of an answer (thesis 4.4.2,
/// 4.4.3). The next update refits by these. Without them it treats every node as visited.
///
/// Recorded pairs: an AdaptiveBVHModel with another model of the same volume, adaptive or not, with
/// a primitive shape, or with an octree (but for signed distances and costs), in either order. Any
/// other pair is handed to FCL.
///
/// `distance` of two adaptive models with Propagation::TranslationCompensated is found by their
/// boxes (docs/bounds.md), starting from the pair of triangles that was nearest in the last query
/// of the two. It is the least of all distances of two triangles as FCL computes them, up to
/// rounding; of several nearest pairs another one may be named. `collide` of two such models is
/// found by their boxes, too: FCL's test of two triangles decides, the order of the contacts is not
/// FCL's, but always the same.
///
/// With a shape or an octree such a model is searched by its boxes as well, and FCL's solver
/// decides about each triangle. A distance is the least of all that the solver computes, up to its
/// tolerance; of several nearest triangles another one may be named. Contacts with a shape come in
/// FCL's order, those with an octree in one that is always the same. A plane and a mesh of RSS have
/// contacts that fcl::collide misses: its volume of the plane stands across it.
///
/// **Distances of two meshes** are exact up to 2^-46 of the extent of the two triangles, beside
/// what S rounds when it places the second mesh in the frame of the first: also of triangles with
/// parallel edges, of needles, and of any size, where FCL's own distance of two triangles is wrong
/// (docs/guide.md, "Where FCL's answers are wrong").
///
/// Everything else runs FCL's own traversal, and every field of the result is what FCL computes on
/// the same trees, except as described below.
///
/// **Order.** `o1` and `o2` of results and contacts are the two meshes as they were passed; else
/// o1 is the mesh and o2 the shape, or o1 the octree and o2 the mesh, whichever was passed first
/// (FCL's order). `b1` and `b2` belong to o1 and o2: the index of a mesh's triangle, FCL's number
/// of an octree's cell, Contact::NONE (-1) of a shape. So do `nearest_points[0]` and `[1]`.
///
/// **Nearest points** are in the world, for every shape and both solvers. (FCL gives those of a
/// sphere and a mesh in each object's own frame, and of a sphere that touches an uninitialised
/// distance; here it is -1 as of every shape that touches.) Two meshes have them when
/// `enable_nearest_points` is set, a shape or an octree with a mesh always. When two meshes touch
/// both points are a common point of theirs, up to rounding; a shape or an octree that touches a
/// mesh has none, but for a signed distance, where both are the position of a contact.
///
/// **Contacts.** Two meshes have one or two contacts for each pair of triangles that touch (FCL's
/// points; `num_max_contacts` counts contacts), a shape one for each triangle, an octree one for
/// each cell and triangle. Which triangles touch does not depend on `enable_contact`. FCL's test
/// decides, except for thin triangles.
///
/// **Thin triangles** are segments, points, and triangles narrower than the root of epsilon times
/// their length (1.5e-8 in double, 3.4e-4 in float). FCL's test finds that many of them touch
/// though they are apart; here they must also be nearer than four times that limit. FCL computes
/// their contacts from memory that it did not set, and mostly leaves the pair out. Here such a pair
/// has one contact: between the nearest points, with depth 0, and with the normal of one of the
/// triangles or, when both are thin, a direction across both. A thin triangle and a sphere have
/// their contact at the nearest point, with FCL's depth (negative).
///
/// **Never uninitialised, never a silent no.** What was not computed is NaN, where FCL leaves what
/// was in memory: position, normal and depth of contacts without `enable_contact`, and nearest
/// points in the cases above that have none. Beyond FCL:
/// - `collide` of two meshes takes the oriented traversal, where fcl::collide copies both models on
///   every call and rebuilds the copy of one that is not at the identity. The contacts are the same
///   set; their order may differ.
/// - std::invalid_argument is thrown for a pair that FCL cannot compute, whether one of the objects
///   is adaptive or not: meshes of different volumes (RSS and OBBRSS, say), the distance to a plane
///   or a half-space, a type that FCL does not know. FCL prints a warning and answers "very far" or
///   "no contact" there, or crashes. It is also thrown for a mesh of RSS or OBBRSS without
///   triangles, and for a transform that is not a rigid motion: not finite, scaled, sheared, or
///   mirrored.
///
/// S is float or double. Thread-safe on shared models, like FCL's; see AdaptiveBVHModel. As in FCL
/// the result is not cleared first: an older, smaller distance in it is kept.
template <typename S>
S distance(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
           const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
           const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  const S before = result.min_distance;
  S found;
  if (detail::recordedDistance(o1, tf1, o2, tf2, request, result, found)) return found;
  found = fcl::distance(o1, tf1, o2, tf2, request, result);
  detail::finishDistance(request, before, result);
  return found;
}

/// The distance of two placed objects.
template <typename S>
S distance(const fcl::CollisionObject<S>* o1, const fcl::CollisionObject<S>* o2,
           const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  return queries::distance(o1->collisionGeometry().get(), o1->getTransform(),
                           o2->collisionGeometry().get(), o2->getTransform(), request, result);
}

/// Returns the number of contacts. Records for tests B and D only, of two models by their boxes for
/// B only: an overlap test computes no distances.
template <typename S>
std::size_t collide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                    const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                    const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  const std::size_t before = result.numContacts();
  std::size_t contacts;
  if (!detail::recordedCollide(o1, tf1, o2, tf2, request, result, contacts))
    contacts = fcl::collide(o1, tf1, o2, tf2, request, result);
  detail::finishCollide(request, before, result);
  return contacts;
}

/// Collides two placed objects.
template <typename S>
std::size_t collide(const fcl::CollisionObject<S>* o1, const fcl::CollisionObject<S>* o2,
                    const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  return queries::collide(o1->collisionGeometry().get(), o1->getTransform(),
                          o2->collisionGeometry().get(), o2->getTransform(), request, result);
}

}  // namespace queries

using namespace queries;  // seen by adaptive_bvh::distance, not by argument-dependent lookup

}  // namespace adaptive_bvh
