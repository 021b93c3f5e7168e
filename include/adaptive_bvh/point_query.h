#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// \file
/// Queries of points and rays on a deforming mesh in its present state; nothing is rebuilt. All
/// points and lengths are in the mesh's own frame and unit.
///
/// Coordinates of points may be as large as those of a mesh (deformable_mesh.h).
///
/// **Errors.** std::invalid_argument if a number is not finite, a direction is zero, or a distance
/// is negative or NaN.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query of many points or rays runs on
/// several threads if DeformableMesh::setThreads allows it.

/// The point of a surface that is nearest to a point.
struct ClosestPoint {
  fcl::Vector3d point;  ///< on the surface
  double distance;      ///< from the query point
  /// With that point. Of several triangles that are exactly as near, the one with the smallest
  /// index, whatever was asked before; so on an edge or a vertex the first of its triangles.
  int triangle;
};

/// Returns the nearest point of the mesh's triangles. The distance is exact up to rounding: 2^-48
/// (4e-15) of the largest distance of `point` to a corner of the triangle. Distances of two
/// triangles are compared with twice the digits where they are that near each other: they count as
/// equal up to 2^-80 of themselves (docs/bounds.md, 16). From more than 10^10 sizes of the body
/// away that makes triangles equal that are not; then it may be any of these.
///
/// Takes a logarithmic time near the body. From 32 sizes on, where many triangles may be as near up
/// to single precision, it takes a pass over the vertices at most, up to 10^11 sizes; from there on
/// all triangles of a face across the line count as equal, and each is tested.
ClosestPoint closestPoint(const DeformableMesh& mesh, const fcl::Vector3d& point);

/// Finds the nearest points of many points, in their order. `result` is overwritten; a reused
/// result allocates nothing. Fastest if consecutive points are near each other.
void closestPoints(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                   std::vector<ClosestPoint>& result);
/// From a vector or a matrix.
inline void closestPoints(const DeformableMesh& mesh, const PointArray& points,
                          std::vector<ClosestPoint>& result) {
  closestPoints(mesh, points.data(), points.size(), result);
}

/// Kind of the feature that a point of a surface lies on.
enum class SurfaceFeature {
  Face,    ///< inside a triangle
  Edge,    ///< between two corners
  Vertex,  ///< a corner
};

/// The nearest point of a surface, and the feature that it lies on.
struct ClosestFeature {
  fcl::Vector3d point;        ///< on the surface; NaN if none is within the limit
  double distance;            ///< from the query point; infinite if none is within the limit
  int triangle;               ///< as ClosestPoint::triangle; -1 if there is none
  fcl::Vector3d barycentric;  ///< weights of the triangle's corners
  /// Whether the point is inside the triangle, on an edge or a corner. A query point that lies
  /// exactly on an edge, for the given numbers, is on it. For others, rounding decides.
  SurfaceFeature feature;
  /// Index of the triangle, number of the edge (feature_pairs.h) or index of the vertex.
  unsigned number;
  /// The surface's outward direction at the point, of length 1: that of the triangle; on an edge
  /// the mean of its triangles; on a vertex their mean weighted by their angles
  /// (VertexContacts::normals). Zero if no triangle there has an area. Triangles are assumed to
  /// face outward.
  fcl::Vector3d normal;
};

/// Finds the nearest points of many points, with features and normals, within a distance of
/// `limit`. `result` is overwritten, and does not depend on the number of threads.
void closestFeatures(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                     double limit, std::vector<ClosestFeature>& result);
/// From a vector or a matrix.
inline void closestFeatures(const DeformableMesh& mesh, const PointArray& points, double limit,
                            std::vector<ClosestFeature>& result) {
  closestFeatures(mesh, points.data(), points.size(), limit, result);
}

/// Computes the distances of many points to the surface, negative inside; trimesh's
/// `signed_distance` is positive there. A point is inside if the winding number of the surface
/// around it is not 0, which is decided without any error. Distances are those of closestPoint.
/// `result` is overwritten; a reused result allocates nothing on one thread. Also throws
/// std::invalid_argument if the mesh is not closed; the message names an edge.
void signedDistances(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                     std::vector<double>& result);
/// From a vector or a matrix.
inline void signedDistances(const DeformableMesh& mesh, const PointArray& points,
                            std::vector<double>& result) {
  signedDistances(mesh, points.data(), points.size(), result);
}

/// Computes the winding numbers of the surface around many points. For a closed surface they are
/// integers without any error, 0 outside. For open meshes and soups they are generalised winding
/// numbers, the sum of the triangles' solid angles divided by 4 pi, which is near 1 well inside
/// (Jacobson, Kavan, Sorkine-Hornung 2013): off by at most 1e-12, or by 2^-52 for each boundary
/// edge where there are more than 4,000. On the surface, 0 or the number
/// of one side. Takes, for each point, the time of a ray and a time in proportion to the boundary
/// edges (isWatertight; of separate triangles, all edges). `result` is overwritten.
void windingNumbers(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                    std::vector<double>& result);
/// From a vector or a matrix.
inline void windingNumbers(const DeformableMesh& mesh, const PointArray& points,
                           std::vector<double>& result) {
  windingNumbers(mesh, points.data(), points.size(), result);
}

/// An edge that its triangles traverse more often in one direction than in the other.
struct OpenEdge {
  unsigned from;      ///< the vertex where it begins, in that direction
  unsigned to;        ///< the vertex where it ends
  unsigned triangle;  ///< with the smallest index that has the edge
  int surplus;        ///< difference of the two counts; 1 on a boundary
};

/// Whether a mesh is closed: the triangles that share an edge traverse it equally often in both
/// directions, so they also face the same side. Vertices are compared by index (weldVertices). If
/// `open_edges` is not null, it is overwritten with all other edges, by increasing triangle.
/// Without it the call takes constant time.
bool isWatertight(const DeformableMesh& mesh, std::vector<OpenEdge>* open_edges = nullptr);

/// Intersection of a ray with a triangle: the point origin + t * direction.
struct RayHit {
  double t;      ///< >= 0 and not -0; infinite if there is no hit
  int triangle;  ///< -1 if there is no hit
  double u;      ///< the point is (1 - u - v) a + u b + v c of the triangle's corners a, b, c
  double v;      ///< as u
};

/// The range of a ray in which hits count: begin <= RayHit::t <= end, for the returned t, rounded
/// to S. Both ends are included, so the segment from `origin` to `origin` + `direction` is {0, 1}.
/// Shadow rays that start on a surface need a begin a little above 0.
struct RayRange {
  double begin = 0;                                      ///< not negative
  double end = std::numeric_limits<double>::infinity();  ///< `begin` or more
};

/// Finds every triangle that a ray hits, by increasing t; for equal t the smaller index first.
/// `direction` has any length. Whether a ray hits a triangle is decided without rounding, for the
/// given numbers. Edges and corners belong to each of their triangles, so a ray cannot pass between
/// two neighbours. A hit has t = 0 if the origin lies exactly in the triangle's plane; a computed
/// origin may lie on either side of it. A triangle is not hit if the ray lies in its plane, or if t
/// exceeds the range of S. `result` is overwritten. Returns the number of hits. Also throws
/// std::invalid_argument if the range is NaN, begins below 0, or ends before it begins.
std::size_t rayHits(const DeformableMesh& mesh, const fcl::Vector3d& origin,
                    const fcl::Vector3d& direction, const RayRange& range,
                    std::vector<RayHit>& result);
/// On the whole ray.
inline std::size_t rayHits(const DeformableMesh& mesh, const fcl::Vector3d& origin,
                           const fcl::Vector3d& direction, std::vector<RayHit>& result) {
  return rayHits(mesh, origin, direction, RayRange(), result);
}

/// Returns the first hit of rayHits.
RayHit firstHit(const DeformableMesh& mesh, const fcl::Vector3d& origin,
                const fcl::Vector3d& direction, const RayRange& range = RayRange());

/// Whether a ray hits any triangle (occlusion). Stops at the first triangle found.
bool anyHit(const DeformableMesh& mesh, const fcl::Vector3d& origin, const fcl::Vector3d& direction,
            const RayRange& range = RayRange());

/// Finds the first hit of each of many rays, in their order, with one range for all. Faster than
/// single calls, because several rays are processed in turn. `result` is overwritten; a reused
/// result allocates nothing on one thread.
void firstHits(const DeformableMesh& mesh, const fcl::Vector3d* origins,
               const fcl::Vector3d* directions, std::size_t count, const RayRange& range,
               std::vector<RayHit>& result);
/// On the whole rays.
inline void firstHits(const DeformableMesh& mesh, const fcl::Vector3d* origins,
                      const fcl::Vector3d* directions, std::size_t count,
                      std::vector<RayHit>& result) {
  firstHits(mesh, origins, directions, count, RayRange(), result);
}
/// From vectors or matrices, one direction for each origin.
inline void firstHits(const DeformableMesh& mesh, const PointArray& origins,
                      const PointArray& directions, const RayRange& range,
                      std::vector<RayHit>& result) {
  firstHits(mesh, origins.data(), directions.data(),
            detail::commonSize(origins.size(), directions.size()), range, result);
}
/// On the whole rays.
inline void firstHits(const DeformableMesh& mesh, const PointArray& origins,
                      const PointArray& directions, std::vector<RayHit>& result) {
  firstHits(mesh, origins, directions, RayRange(), result);
}

/// Finds for each of many rays, in their order, whether it hits any triangle: 1 if it does, else 0.
/// Otherwise like firstHits.
void anyHits(const DeformableMesh& mesh, const fcl::Vector3d* origins,
             const fcl::Vector3d* directions, std::size_t count, const RayRange& range,
             std::vector<std::uint8_t>& result);
/// On the whole rays.
inline void anyHits(const DeformableMesh& mesh, const fcl::Vector3d* origins,
                    const fcl::Vector3d* directions, std::size_t count,
                    std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins, directions, count, RayRange(), result);
}
/// From vectors or matrices, one direction for each origin.
inline void anyHits(const DeformableMesh& mesh, const PointArray& origins,
                    const PointArray& directions, const RayRange& range,
                    std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins.data(), directions.data(),
          detail::commonSize(origins.size(), directions.size()), range, result);
}
/// On the whole rays.
inline void anyHits(const DeformableMesh& mesh, const PointArray& origins,
                    const PointArray& directions, std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins, directions, RayRange(), result);
}

}  // namespace adaptive_bvh
