#pragma once

#include <cstddef>
#include <vector>

#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/proximity.h"

namespace adaptive_bvh {

/// \file
/// Derivatives of distances with respect to the vertices of the meshes, as arrays that a solver
/// adds up. They are computed from what another query has found: pairs of features with their
/// details, contacts of vertices, or the nearest triangles of two meshes.
///
/// **Definition.** Let p be the nearest point of the first feature and q that of the second, with
/// the weights v and w of their vertices, and n the normal from the first to the second. The
/// gradient by a vertex of the first feature is -v n, and by one of the second w n. The normal is
/// turned to the frame of the vertex's mesh. So the distance changes by the sum of
/// gradient . displacement over all entries, if displacements are in the frames of their meshes.
/// The gradients of one distance add up to zero in the world, and so do their moments.
///
/// **Ties.** A distance is the least length of q - p over all points of both features, or of both
/// meshes. Where the weights of one pair of points are the only nearest ones, it is differentiable,
/// and the gradients are its derivative. Where several are (parallel edges, an edge along a face,
/// triangles that are as near, vertices in one place), it has one-sided derivatives only: along
/// displacements h the least of g . h, over the gradients g of all nearest weights (Danskin). The
/// result has the g of one of them: an element of the generalised gradient (Clarke 1983), and g . h
/// is never less than the one-sided derivative. It is the one that the details name, in
/// FeatureDetails::coordinates or VertexContacts::barycentric. Of parallel edges this may be any
/// pair of points across their common part. A signed distance inside is minus that least length:
/// its one-sided derivative is the largest g . h.
///
/// **Touching.** At the distance 0 the normal is that of FeatureDetails::normals or
/// VertexContacts::normals. The gradients are then the derivative of the gap along the normal, and
/// zero if the normal is zero.
/// - Where two edges cross, or a vertex lies inside a face, the one-sided derivative of the
///   distance of the two features is |g . h|.
/// - At the end of an edge, or the side or corner of a face, it is at least g . h, if one pair of
///   points touches and the surface is convex there. So g is an element of the generalised
///   gradient.
/// - Where the surface is not convex, g need not be one, because the normal is that of the surface,
///   not of the face. Parallel edges may touch in many points; g is that of one of them.
/// - The signed distance of a vertex has the derivative g inside a face of the other surface. On
///   edges and vertices g is that of the pseudo-normal.
/// - Two meshes that touch have gradients of zero: their distance is least there. Zero is always an
///   element of the generalised gradient of an unsigned distance of 0.
///
/// **Exactness.** Let d be the distance that was found, X the largest coordinate of both meshes and
/// of their origins in the frame of either, and let no vertex move by more than m in the world. If
/// d > 1e-8 X, the distance after the motion h is at most
///
///     d + g . h + 2.01 m^2 / d + 2^-42 (X + m X / d),
///
/// whatever the shapes of the features, also at ties. The same holds for depths, as a bound of the
/// signed distance from below. Of a contact inside a face, whose normal is the face's, the bound
/// also has 2^-46 m X / a, for the height a of the face over its longest side. The
/// direction of a normal is exact up to 2^-21 sqrt(X / d). Proof: docs/bounds.md, 20.
///
/// **Errors.** std::invalid_argument if a transform is not a rigid motion, if the arrays of an
/// argument differ in length, or if it names a vertex, edge or triangle that a mesh does not have.
/// The result is then unchanged. After std::bad_alloc it is valid, with unspecified contents.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. Runs on several threads if
/// DeformableMesh::setThreads allows it; the result does not depend on their number. A reused
/// result allocates nothing on one thread.

/// Gradients of distances by the vertices of one mesh, in parallel arrays: row i of distance i has
/// `per_distance` entries, from i * per_distance on. Vertices may repeat between rows.
struct VertexGradients {
  /// Vertices of each distance: 1 of a vertex, 2 of an edge, 3 of a face; 0 for a shape.
  std::size_t per_distance = 0;
  std::vector<unsigned> vertices;  ///< indices in the mesh; of an edge and a face in their order
  /// Derivatives by these vertices, in the mesh's frame. They have no unit.
  std::vector<fcl::Vector3d> gradients;

  /// How many distances.
  std::size_t rows() const { return per_distance == 0 ? 0 : vertices.size() / per_distance; }
  /// Resizes all arrays. Keeps the memory.
  void resize(std::size_t rows, std::size_t entries_per_row) {
    per_distance = entries_per_row;
    vertices.resize(rows * per_distance);
    gradients.resize(rows * per_distance);
  }
};

/// Derivatives of distances of one kind.
struct DistanceDerivatives {
  VertexGradients first;   ///< by vertices of the first mesh
  VertexGradients second;  ///< by vertices of the second
};

/// Derivatives of the distances of FeaturePairs, for each kind in their order.
struct FeaturePairDerivatives {
  DistanceDerivatives vertex_face;  ///< by 1 vertex of the first mesh and 3 of the second
  DistanceDerivatives face_vertex;  ///< by 3 and 1
  DistanceDerivatives edge_edge;    ///< by 2 and 2
};

/// Computes the derivatives of FeatureDetails::distances. `details` is the result of
/// featurePairDetails for these pairs and transforms. `result` is overwritten.
void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const DeformableMesh& second, const fcl::Transform3d& tf2,
                         const FeaturePairs& pairs, const FeaturePairDetails& details,
                         FeaturePairDerivatives& result);

/// The derivatives of pairs of one mesh with itself: both `first` and `second` of the result are by
/// vertices of this mesh, and a solver adds both.
void selfDistanceDerivatives(const DeformableMesh& mesh, const FeaturePairs& pairs,
                             const FeaturePairDetails& details, FeaturePairDerivatives& result);

/// Computes the derivatives of VertexContacts::distances, which are signed: by 1 vertex of `first`
/// and 3 of `second`. `contacts` is the result of vertexContacts for these arguments. `result` is
/// overwritten.
void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const DeformableMesh& second, const fcl::Transform3d& tf2,
                         const VertexContacts& contacts, DistanceDerivatives& result);

/// The derivatives of contacts with a shape: by 1 vertex of `first`; `result.second` is empty. (If
/// `second` is a DeformableMesh, the result is that of the overload for two meshes.)
void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const fcl::CollisionGeometryd& second, const fcl::Transform3d& tf2,
                         const VertexContacts& contacts, DistanceDerivatives& result);

/// Computes the derivative of the distance of two meshes: by the 3 corners of triangle `b1` of the
/// first and the 3 of triangle `b2` of the second. `nearest` is the result of CoherentDistance, or
/// of adaptive_bvh::distance of two DeformableMeshes. Only its triangles are read; their nearest
/// points are computed again, so it need not have any. `result` is overwritten, with one row.
void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const DeformableMesh& second, const fcl::Transform3d& tf2,
                         const fcl::DistanceResultd& nearest, DistanceDerivatives& result);

}  // namespace adaptive_bvh
