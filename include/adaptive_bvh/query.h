#pragma once

#include <cstddef>

#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/build_flags.h"

namespace adaptive_bvh {

/// Contains `adaptive_bvh::distance` and `adaptive_bvh::collide`. They are not members of the
/// namespace of AdaptiveBVHModel itself, because argument-dependent lookup would then make an
/// unqualified call ambiguous: `distance(&model, ...)` under `using namespace fcl` remains
/// fcl::distance. (After `using namespace adaptive_bvh` as well, write the namespace.)
namespace queries {

/// Returns the distance of two objects. `distance` and `collide` have FCL's signatures, but are
/// exact, and faster for a DeformableMesh.
///
/// **Pairs.** These are answered here, in either order:
/// - a DeformableMesh with another one, or with an AdaptiveBVHModel whose mesh() was made, by their
///   trees of boxes;
/// - two models with the same volumes, RSS or OBBRSS, AdaptiveBVHModel or FCL's own, by FCL's
///   traversal of these volumes, with this library's test of two triangles. In adaptive models it
///   records which volumes kept the search from an answer (thesis 4.4.2, 4.4.3); the next update
///   uses this for its fitness tests. Without such a query an update treats every node as visited;
/// - any of these with a sphere, capsule, box, cylinder, cone, ellipsoid, convex, plane or
///   half-space, and with an octree, but for signed distances and costs.
///
/// Any other pair without a DeformableMesh is passed to FCL.
///
/// **Conventions**, for every pair that is answered here:
///
/// |                    | two meshes            | mesh and shape      | mesh and octree     |
/// | ------------------ | --------------------- | ------------------- | ------------------- |
/// | `o1`, `o2`         | as passed             | mesh, shape         | octree, mesh        |
/// | distance, apart    | > 0                   | > 0                 | > 0                 |
/// | distance, touching | 0                     | 0, also inside      | 0, also inside      |
/// | signed distance    | the same              | minus the depth     | FCL answers         |
/// | contact: depth     | >= 0, FCL's           | >= 0                | >= 0                |
/// | contact: normal    | a triangle's, FCL's   | from o1 to o2       | from o1 to o2       |
/// | contact: position  | FCL's                 | a common point      | a common point      |
///
/// The order of `o1` and `o2` is FCL's, whichever was passed first. Normals have length 1. The
/// depth of a triangle and a shape or cell is the length of the shortest translation that separates
/// them: o2 moved by the depth along the normal no longer overlaps that triangle of o1. A signed
/// distance is minus the largest depth of a triangle. FCL differs: fcl::distance returns -1 for a
/// shape that touches, and with `enable_signed_distance` often a number that is no depth;
/// fcl::collide gives a sphere's depth a negative sign.
///
/// `b1` and `b2` belong to o1 and o2: the index of a mesh's triangle, FCL's number of an octree's
/// cell, Contact::NONE (-1) for a shape. `nearest_points[0]` and `[1]` belong to o1 and o2 as well.
/// If several pairs are nearest, any one of them may be returned.
///
/// **Exactness.** Two triangles touch if they have a common point. That is decided without any
/// error, for the second's corners as rounded to double precision in the frame of the first.
/// `collide`, `distance`, isNearer and pairsWithin agree about every pair. Distances of two meshes
/// are exact up to 2^-46 of the extent of the two triangles. That includes triangles with parallel
/// edges, needles and triangles of any size, for which FCL's distance of two triangles is wrong
/// (docs/guide.md, "Where FCL's answers are wrong"). Distances to a sphere, capsule, box, plane,
/// half-space or cell are those of their geometry, with the same error; to a cylinder, cone,
/// ellipsoid or convex they are off by less than 2^-42 of the extent. (A convex counts as touching
/// below 2^-46.) Depths are exact up to 2^-38 of the extent, those of a convex up to 1e-10.
/// The solver that a request names is not used.
///
/// **Nearest points** are in the world. For two meshes they are computed if `enable_nearest_points`
/// is set, for a mesh and a shape or an octree always. If the two touch, both points are a common
/// point, up to rounding; for a signed distance, the position of the deepest contact. (FCL gives
/// the points of a sphere and a mesh in each object's own frame, and leaves some uninitialised.)
///
/// **Contacts.** Two meshes have one or two contacts for each pair of triangles that touch (FCL's
/// points; `num_max_contacts` counts contacts), a shape one for each triangle, an octree one for
/// each cell and triangle. Which triangles touch does not depend on `enable_contact`. The order
/// differs from FCL's, but is deterministic.
///
/// **Thin triangles** are segments, points, and triangles narrower than the root of epsilon times
/// their length (1.5e-8). For two meshes with such triangles FCL reads
/// uninitialised memory, and mostly leaves the pair out. Here such a pair has one contact: between
/// the nearest points, with depth 0, and with the normal of one of the triangles or, if both are
/// thin, a direction perpendicular to both.
///
/// **Values that were not computed** are NaN; FCL leaves them uninitialised. These are position,
/// normal and depth of contacts without `enable_contact`, and nearest points that were not
/// requested.
///
/// **Errors.** Throws std::invalid_argument for a pair that neither this library nor FCL can
/// compute: meshes of different volumes (such as RSS and OBBRSS), the distance of a plane and a
/// mesh with volumes of another kind, a type that FCL does not know. (FCL prints a warning and
/// answers "very far" or "no contact", or crashes.) Also for a DeformableMesh with a plain
/// fcl::BVHModel or with a model whose mesh was not made, for a model of RSS or OBBRSS without
/// triangles, and for a transform that is not a rigid motion: not finite, scaled, sheared, or
/// mirrored. Also for a shape and a mesh if a size of the shape is not positive and finite, or if
/// all its sizes are below 2^-204 (3.9e-62).
///
/// Thread-safe on shared models, like FCL; see AdaptiveBVHModel. As in FCL
/// the result is not cleared first: a smaller distance that it already holds is kept.
double distance(const fcl::CollisionGeometryd* o1, const fcl::Transform3d& tf1,
                const fcl::CollisionGeometryd* o2, const fcl::Transform3d& tf2,
                const fcl::DistanceRequestd& request, fcl::DistanceResultd& result);

/// Returns the distance of two objects with their transforms.
double distance(const fcl::CollisionObjectd* o1, const fcl::CollisionObjectd* o2,
                const fcl::DistanceRequestd& request, fcl::DistanceResultd& result);

/// Finds the contacts of two objects. Returns their number. In adaptive models it records for tests
/// B and D only, because an overlap test computes no distances.
///
/// With `solid`, meshes are filled, as shapes always are: a body inside of a closed mesh touches
/// it, even if their surfaces are far apart. If no triangles touch, there is one contact for each
/// component (triangles joined by vertices) inside of the other mesh, and one for a shape inside of
/// a mesh. Its position is a vertex of the component or a point of the shape. Its depth is the
/// distance of that point from the surface around it, and its normal is the direction in which the
/// point leaves the mesh. `b1` and `b2` are the component's triangle with the smallest index, and
/// the nearest triangle around it. For the depth of the bodies use signedDistance (penetration.h).
/// Throws std::invalid_argument for a mesh that is not closed, for an octree, and for models
/// without a DeformableMesh.
std::size_t collide(const fcl::CollisionGeometryd* o1, const fcl::Transform3d& tf1,
                    const fcl::CollisionGeometryd* o2, const fcl::Transform3d& tf2,
                    const fcl::CollisionRequestd& request, fcl::CollisionResultd& result,
                    bool solid = false);

/// Finds the contacts of two objects with their transforms. Returns their number.
std::size_t collide(const fcl::CollisionObjectd* o1, const fcl::CollisionObjectd* o2,
                    const fcl::CollisionRequestd& request, fcl::CollisionResultd& result,
                    bool solid = false);

}  // namespace queries

using namespace queries;  // seen by adaptive_bvh::distance, not by argument-dependent lookup

}  // namespace adaptive_bvh
