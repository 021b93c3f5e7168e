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
/// is positive there. A normal points from the first object, the mesh of the vertex, to the second
/// one, the other body: it is opposite to the other body's outward direction. A force that keeps
/// the surfaces `distance` apart, with a stiffness in pressure per length, is:
///
///     force[c.vertices[i]] -= stiffness * (distance - c.distances[i]) * c.areas[i] * c.normals[i];
///
/// **Exactness.** Distances are exact up to rounding: 2^-48 (4e-15) of the largest distance of the
/// vertex to a corner of the nearest triangle. Whether a vertex is inside is decided without any
/// error, for the vertex as rounded to double precision in the other's frame: it is inside if the
/// winding number of the surface around it is not 0. A vertex whose computed distance is 0 is on
/// the surface, and counts as outside.
///
/// **Errors.** std::invalid_argument if the distance is negative or NaN (infinity returns every
/// vertex), if a transform is not a rigid motion, if the other mesh is not closed (the message
/// names an edge), on geometry that is neither a mesh nor a shape, and on a shape with a size that
/// is not positive and finite. The result is then unchanged.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query runs on several threads if
/// DeformableMesh::setThreads allows it; results and their order do not depend on their
/// number. On one thread a reused result allocates nothing once it has grown.

/// The vertices of a mesh that are near another body or inside of it, in parallel arrays, by
/// increasing index. Positions and directions are in the world.
struct VertexContacts {
  std::vector<unsigned> vertices;             ///< indices; only vertices of triangles
  std::vector<double> distances;              ///< to the other's surface; negative inside
  std::vector<fcl::Vector3d> positions;       ///< of the vertices
  std::vector<fcl::Vector3d> nearest_points;  ///< on the other's surface
  /// Of length 1, from the vertex's mesh to the other body: from the vertex to the nearest point if
  /// the vertex is outside, from the nearest point to the vertex if it is inside. If the nearest
  /// point is inside a triangle, the normal is perpendicular to that triangle. A vertex nearer to
  /// the surface than 1e-8 of the coordinates has no such direction. Its normal is the opposite of
  /// the surface's outward direction at the nearest point: that of a triangle; on an edge the mean
  /// of its triangles; on a vertex their mean weighted by their angles there (Baerentzen and Aanaes
  /// 2005, "Signed distance computation using the angle weighted pseudonormal"). Triangles are
  /// assumed to face outward: their corners are counter-clockwise seen from outside. If these
  /// directions cancel each other, the triangle there with the smallest index and a nonzero area
  /// decides.
  std::vector<fcl::Vector3d> normals;
  /// Triangle of the other mesh with the nearest point: the one with the smallest index if several
  /// are exactly as near (ClosestPoint::triangle). -1 if the other body is a shape.
  std::vector<int> triangles;
  /// Weights of the three corners of that triangle at the nearest point; zero if there is none.
  std::vector<fcl::Vector3d> barycentric;
  /// One third of the area of the vertex's triangles, in the mesh's unit squared.
  std::vector<double> areas;

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

/// Finds every vertex of `first` that is at most `distance` away from the surface of `second`, or
/// inside of it. `second` must be closed. `result` is overwritten. Returns the number of contacts.
std::size_t vertexContacts(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2,
                           double distance, VertexContacts& result);

/// Finds the vertices of `mesh` near or inside a shape of FCL's: a sphere, capsule, box, cylinder,
/// cone, ellipsoid, convex, plane or half-space. (If `second` is a DeformableMesh, the result is
/// that of the overload for two meshes.) Distances, points and normals follow the formula of the
/// shape, up to 16 units roundoff of the coordinates; for a convex, which is the hull of its
/// vertices, up to 2^-44 of its extent outside and 1e-10 of it inside. A plane has no inside.
/// Normals on edges and tips are the opposite of the mean of the directions around them.
std::size_t vertexContacts(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const fcl::CollisionGeometryd& second, const fcl::Transform3d& tf2,
                           double distance, VertexContacts& result);

/// Finds the contacts of both meshes: the vertices of `first` with the body of `second`, and the
/// vertices of `second` with the body of `first`. Both must be closed. The normals of either result
/// point from the vertex's mesh to the other. Returns the number of all contacts.
std::size_t vertexContacts(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2,
                           double distance, VertexContacts& of_first, VertexContacts& of_second);

/// The body with the deepest point on its surface.
enum class DeepBody {
  None,    ///< no point of either body was found inside of the other
  First,   ///< a point of the first, inside of the second
  Second,  ///< a point of the second, inside of the first
};

/// The signed distance of two bodies.
struct SignedDistance {
  double lower = 0;                     ///< the signed distance is at least this
  double upper = 0;                     ///< the signed distance is at most this
  DeepBody deep_body = DeepBody::None;  ///< None: the bodies are apart, or touch
  /// A point on the surface of the first body and one on that of the second, in the world. If the
  /// bodies are apart, the nearest points. Otherwise a point of the deep body's surface, whose
  /// depth is -`upper`, and the nearest point of the other surface to it.
  std::array<fcl::Vector3d, 2> points;
  /// From the first body to the second, of length 1: from the first point to the second if the
  /// bodies are apart, otherwise from the second point to the first. So points[1] - points[0] is
  /// always the signed distance times the normal, and moving the second body by the depth along the
  /// normal separates these two points. If the points are nearer than 1e-8 of the coordinates, it
  /// is a normal of the surface there: out of the first body or into the second.
  fcl::Vector3d normal;
  std::size_t searches = 0;  ///< number of searches for the distance of a point to a surface
};

/// Returns the signed distance of two closed meshes. If the surfaces do not cross and neither body
/// is inside of the other, it is their distance, 0 if they touch. Otherwise it is minus the depth:
/// the largest distance to the other's surface of any point of either *surface* inside of the other
/// body. All points count, not only vertices, so the result does not depend on the triangulation of
/// a surface. (The depth is not the length of the shortest translation that separates the bodies,
/// which is at least as long.) A point is inside if the winding number is not 0: a body in the
/// hollow of another one is apart from it.
///
/// The bounds differ by at most `tolerance`, and contain the signed distance despite rounding
/// (docs/bounds.md, 19). Time grows with the part of the
/// surfaces that is within the tolerance of the deepest point. The tolerance is raised to 2^-30
/// (1e-9) of the coordinates of both bodies, in the frame of either, and to 6 times the difference
/// of R^T R from the identity, for the rotation R of either transform.
///
/// Runs on one thread. Throws std::invalid_argument if the tolerance is negative or NaN, if a
/// transform is not a rigid motion, and if a mesh is not closed; the message names an edge.
SignedDistance signedDistance(const DeformableMesh& first, const fcl::Transform3d& tf1,
                              const DeformableMesh& second, const fcl::Transform3d& tf2,
                              double tolerance);

/// Returns the signed distance of a closed mesh and a solid of FCL's: a sphere, capsule, box,
/// cylinder, cone, ellipsoid, convex or half-space. (If `second` is a DeformableMesh, the result is
/// that of the overload for two meshes.) Curved surfaces are not approximated. A convex counts by
/// its faces; throws std::invalid_argument if they do not enclose it, on a plane, which has no
/// inside, and if a size of the shape is not positive and finite.
SignedDistance signedDistance(const DeformableMesh& first, const fcl::Transform3d& tf1,
                              const fcl::CollisionGeometryd& second, const fcl::Transform3d& tf2,
                              double tolerance);

}  // namespace adaptive_bvh
