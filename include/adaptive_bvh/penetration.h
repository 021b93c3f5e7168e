#pragma once

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

}  // namespace adaptive_bvh
