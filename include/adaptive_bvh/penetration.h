#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// \file
/// Contacts for forces: depth, normal and area at every vertex that is near a body or inside of it.
///
/// **Signs.** A signed distance is negative inside of the other body; trimesh's `signed_distance`
/// is positive there. A normal points from the first object, the mesh that has the vertex, to the
/// second one, the other body: it is the opposite of the other body's outward direction. So a force
/// that keeps the surfaces `margin` apart, with a stiffness in pressure per length, is one line:
///
///     force[c.vertices[i]] -= stiffness * (margin - c.distances[i]) * c.areas[i] * c.normals[i];
///
/// **Exactness.** Distances are exact up to rounding: 2^-48 (4e-15) of the largest distance of the
/// vertex to a corner of the nearest triangle. Whether a vertex is inside is decided without any
/// error, for the vertex as it is placed in the other's frame in double precision: it is inside
/// where the surface winds around it (the winding number is not 0). A vertex whose computed
/// distance is 0 is on the surface, and outside.
///
/// **Errors.** std::invalid_argument when the margin is negative or NaN (infinity is fine: every
/// vertex is returned), when a transform is not a rigid motion, when the other mesh is not closed
/// (the message names an edge), and on geometry that is no mesh and no shape. A result is then as
/// it was.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query takes several threads itself
/// where DeformableMesh::setQueryThreads says so; results and their order are the same whatever
/// their number. On one thread a result that is used again allocates nothing once it has grown.

/// The vertices of a mesh that are near another body or inside of it, in arrays side by side, by
/// increasing index. Positions and directions are in the world.
template <typename S>
struct VertexContacts {
  std::vector<unsigned> vertices;               ///< indices; only vertices that a triangle has
  std::vector<S> distances;                     ///< to the other's surface; negative inside
  std::vector<fcl::Vector3<S>> positions;       ///< of the vertices
  std::vector<fcl::Vector3<S>> nearest_points;  ///< on the other's surface
  /// Of length 1, from the vertex's mesh to the other body: where the vertex is apart, from the
  /// vertex to the nearest point; where it is inside, from the nearest point to the vertex. Where
  /// the nearest point is inside a triangle, it is across that triangle. A vertex nearer to the
  /// surface than 1e-8 of the coordinates has no such direction; then it is the opposite of the
  /// outward direction of the surface at the nearest point: of a triangle; on an edge the mean of
  /// its triangles; on a vertex their mean weighted by their angles there (Baerentzen and Aanaes
  /// 2005, "Signed distance computation using the angle weighted pseudonormal"). Triangles are
  /// taken to face outward: their corners are counter-clockwise seen from outside. Where these
  /// directions cancel each other, the triangle with the smallest index there that has an area
  /// decides.
  std::vector<fcl::Vector3<S>> normals;
  /// Of the other mesh, with the nearest point: the one with the smallest index where several have
  /// it. -1 where the other body is a shape.
  std::vector<int> triangles;
  /// Of the nearest point, for the three corners of that triangle; zero where there is none.
  std::vector<fcl::Vector3<S>> barycentric;
  /// One third of the area of the triangles that have the vertex, in the mesh's unit squared.
  std::vector<S> areas;

  /// How many contacts.
  std::size_t size() const { return vertices.size(); }
  /// Keeps the memory.
  void clear() {
    vertices.clear();
    distances.clear();
    positions.clear();
    nearest_points.clear();
    normals.clear();
    triangles.clear();
    barycentric.clear();
    areas.clear();
  }
};

/// Every vertex of `mesh` that is at most `margin` away from the surface of `other`, or inside of
/// it. `other` must be closed. `result` is overwritten. Returns the number of contacts.
template <typename S>
std::size_t vertexContacts(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                           const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf,
                           S margin, VertexContacts<S>& result);

/// As above, with a shape of FCL's: a sphere, capsule, box, cylinder, cone, ellipsoid, convex,
/// plane or half-space. (Another DeformableMesh is answered as above.) Distances, points and
/// normals by the formula of the shape, up to 16 units roundoff of the coordinates; of a convex,
/// which is the hull of its vertices, up to 2^-44 of its extent outside and 1e-10 of it inside. A
/// plane has no inside. Normals on edges and tips are the opposite of the mean of the directions
/// around.
template <typename S>
std::size_t vertexContacts(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                           const fcl::CollisionGeometry<S>& other,
                           const fcl::Transform3<S>& other_tf, S margin, VertexContacts<S>& result);

/// As above, of both: the vertices of `first` with the body of `second`, and the vertices of
/// `second` with the body of `first`. Both must be closed. Normals of either point from the
/// vertex's mesh to the other.
template <typename S>
std::size_t vertexContacts(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                           const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2, S margin,
                           VertexContacts<S>& of_first, VertexContacts<S>& of_second);

/// Which body has the deepest point on its surface.
enum class DeepBody {
  None,    ///< no point was found inside of the other body
  First,   ///< a point of the first, inside of the second
  Second,  ///< a point of the second, inside of the first
};

/// The signed distance of two bodies.
template <typename S>
struct SignedDistance {
  S lower;             ///< the signed distance is at least this
  S upper;             ///< the signed distance is at most this
  DeepBody deep_body;  ///< None: the bodies are apart, or touch
  /// On the surface of the first and of the second, in the world. Apart: the nearest points.
  /// Inside: a point of the deep body's surface, whose depth is -`upper`, and the other surface's
  /// nearest point to it.
  std::array<fcl::Vector3<S>, 2> points;
  /// From the first body to the second, of length 1. Apart, from the first point to the second;
  /// inside, from the second point to the first. So points[1] - points[0] is always the signed
  /// distance times the normal, and the second body moved by the depth along the normal takes these
  /// two points apart. Where the points are nearer than 1e-8 of the coordinates, a direction of the
  /// surface there: out of the first body or into the second.
  fcl::Vector3<S> normal;
  std::size_t searches;  ///< how often the distance of a point to a surface was searched for
};

/// The signed distance of two closed meshes. Where the surfaces are apart and neither body is
/// inside of the other: their distance, 0 where they touch. Where one is inside of the other, or
/// the surfaces cross: minus the depth, the largest distance to the other's surface that any point
/// of either *surface* has inside of the other body. All points count, not only vertices, so the
/// result does not depend on how a surface is cut into triangles. (It is not the length of the
/// shortest motion that takes the bodies apart, which is at least as long as the depth.) Inside is
/// where the winding number is not 0: a body in the hollow of another one is apart from it.
///
/// The bounds differ by at most `tolerance`, and contain the signed distance whatever is rounded
/// (docs/bounds.md, 19); both are then rounded outward to S. Time grows with the part of the
/// surfaces that is within the tolerance of the deepest point. A tolerance below 2^-30 (1e-9) of
/// the coordinates of both bodies, seen from either, counts as that, and so does one below 6 times
/// what R^T R differs from the identity, for the rotation R of either transform (1e-6 in all as a
/// rule where S is float).
///
/// One thread computes it. Throws std::invalid_argument when the tolerance is negative or NaN, when
/// a transform is not a rigid motion, and when a mesh is not closed; the message names an edge.
template <typename S>
SignedDistance<S> signedDistance(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                                 const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                                 S tolerance);

/// As above, of a closed mesh and a solid of FCL's: a sphere, capsule, box, cylinder, cone,
/// ellipsoid, convex or half-space. (Another DeformableMesh is answered as above.) Curved surfaces
/// count as they are. Of a convex its faces count; std::invalid_argument where they do not enclose
/// it, and on a plane, which has no inside.
template <typename S>
SignedDistance<S> signedDistance(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                                 const fcl::CollisionGeometry<S>& second,
                                 const fcl::Transform3<S>& tf2, S tolerance);

}  // namespace adaptive_bvh
