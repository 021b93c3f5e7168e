#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// \file
/// Queries of points and rays on a deforming mesh in its present state; nothing is rebuilt. All
/// points and lengths are in the mesh's own frame and unit. Computed in double precision for meshes
/// of either precision.
///
/// Coordinates of points may be as large as those of a mesh (deformable_mesh.h).
///
/// **Errors.** std::invalid_argument if a number is not finite, a direction is zero, or a distance
/// is negative or NaN.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query of many points or rays runs on
/// several threads if DeformableMesh::setQueryThreads allows it.

/// The point of a surface that is nearest to a point.
template <typename S>
struct ClosestPoint {
  fcl::Vector3<S> point;  ///< on the surface
  S distance;             ///< from the query point
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
template <typename S>
ClosestPoint<S> closestPoint(const DeformableMesh<S>& mesh,
                             const NonDeduced<fcl::Vector3<S>>& point);

/// Finds the nearest points of many points, in their order. `result` is overwritten; a reused
/// result allocates nothing. Fastest if consecutive points are near each other.
template <typename S>
void closestPoints(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                   std::vector<ClosestPoint<S>>& result);
/// From a vector or a matrix.
template <typename S>
void closestPoints(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& points,
                   std::vector<ClosestPoint<S>>& result) {
  closestPoints(mesh, points.data(), points.size(), result);
}

/// Kind of the feature that a point of a surface lies on.
enum class SurfaceFeature {
  Face,    ///< inside a triangle
  Edge,    ///< between two corners
  Vertex,  ///< a corner
};

/// The nearest point of a surface, and the feature that it lies on.
template <typename S>
struct ClosestFeature {
  fcl::Vector3<S> point;        ///< on the surface; NaN if none is within the limit
  S distance;                   ///< from the query point; infinite if none is within the limit
  int triangle;                 ///< as ClosestPoint::triangle; -1 if there is none
  fcl::Vector3<S> barycentric;  ///< weights of the triangle's corners
  /// Whether the point is inside the triangle, on an edge or a corner. A query point that lies
  /// exactly on an edge, for the given numbers, is on it. For others, rounding decides.
  SurfaceFeature feature;
  /// Index of the triangle, number of the edge (feature_pairs.h) or index of the vertex.
  unsigned number;
  /// The surface's outward direction at the point, of length 1: that of the triangle; on an edge
  /// the mean of its triangles; on a vertex their mean weighted by their angles
  /// (VertexContacts::normals). Zero if no triangle there has an area. Triangles are assumed to
  /// face outward.
  fcl::Vector3<S> normal;
};

/// Finds the nearest points of many points, with features and normals, within a distance of
/// `limit`. `result` is overwritten, and does not depend on the number of threads.
template <typename S>
void closestFeatures(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points,
                     std::size_t count, NonDeduced<S> limit,
                     std::vector<ClosestFeature<S>>& result);
/// From a vector or a matrix.
template <typename S>
void closestFeatures(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& points,
                     NonDeduced<S> limit, std::vector<ClosestFeature<S>>& result) {
  closestFeatures(mesh, points.data(), points.size(), limit, result);
}

/// Computes the distances of many points to the surface, negative inside; trimesh's
/// `signed_distance` is positive there. A point is inside if the winding number of the surface
/// around it is not 0, which is decided without any error. Distances are those of closestPoint.
/// `result` is overwritten; a reused result allocates nothing on one thread. Also throws
/// std::invalid_argument if the mesh is not closed; the message names an edge.
template <typename S>
void signedDistances(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points,
                     std::size_t count, std::vector<S>& result);
/// From a vector or a matrix.
template <typename S>
void signedDistances(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& points,
                     std::vector<S>& result) {
  signedDistances(mesh, points.data(), points.size(), result);
}

/// Computes the winding numbers of the surface around many points. For a closed surface they are
/// integers without any error, 0 outside. For open meshes and soups they are generalised winding
/// numbers, the sum of the triangles' solid angles divided by 4 pi, which is near 1 well inside
/// (Jacobson, Kavan, Sorkine-Hornung 2013): off by at most 1e-12, or by 2^-52 for each boundary
/// edge where there are more than 4,000, and by the rounding to S. On the surface, 0 or the number
/// of one side. Takes, for each point, the time of a ray and a time in proportion to the boundary
/// edges (isWatertight; of separate triangles, all edges). `result` is overwritten.
template <typename S>
void windingNumbers(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                    std::vector<S>& result);
/// From a vector or a matrix.
template <typename S>
void windingNumbers(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& points,
                    std::vector<S>& result) {
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
template <typename S>
bool isWatertight(const DeformableMesh<S>& mesh, std::vector<OpenEdge>* open_edges = nullptr);

/// Intersection of a ray with a triangle: the point origin + t * direction.
template <typename S>
struct RayHit {
  S t;           ///< >= 0 and not -0; infinite if there is no hit
  int triangle;  ///< -1 if there is no hit
  S u;           ///< the point is (1 - u - v) a + u b + v c of the triangle's corners a, b, c
  S v;           ///< as u
};

/// The range of a ray in which hits count: begin <= RayHit::t <= end, for the returned t, rounded
/// to S. Both ends are included, so the segment from `origin` to `origin` + `direction` is {0, 1}.
/// Shadow rays that start on a surface need a begin a little above 0.
template <typename S>
struct RayRange {
  S begin = 0;                                 ///< not negative
  S end = std::numeric_limits<S>::infinity();  ///< `begin` or more
};

/// Finds every triangle that a ray hits, by increasing t; for equal t the smaller index first.
/// `direction` has any length. Whether a ray hits a triangle is decided without rounding, for the
/// given numbers. Edges and corners belong to each of their triangles, so a ray cannot pass between
/// two neighbours. A hit has t = 0 if the origin lies exactly in the triangle's plane; a computed
/// origin may lie on either side of it. A triangle is not hit if the ray lies in its plane, or if t
/// exceeds the range of S. `result` is overwritten. Returns the number of hits. Also throws
/// std::invalid_argument if the range is NaN, begins below 0, or ends before it begins.
template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
                    const NonDeduced<fcl::Vector3<S>>& direction,
                    const NonDeduced<RayRange<S>>& range, std::vector<RayHit<S>>& result);
/// On the whole ray.
template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
                    const NonDeduced<fcl::Vector3<S>>& direction, std::vector<RayHit<S>>& result) {
  return rayHits(mesh, origin, direction, RayRange<S>(), result);
}

/// Returns the first hit of rayHits.
template <typename S>
RayHit<S> firstHit(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
                   const NonDeduced<fcl::Vector3<S>>& direction,
                   const NonDeduced<RayRange<S>>& range = RayRange<S>());

/// Whether a ray hits any triangle (occlusion). Stops at the first triangle found.
template <typename S>
bool anyHit(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
            const NonDeduced<fcl::Vector3<S>>& direction,
            const NonDeduced<RayRange<S>>& range = RayRange<S>());

/// Finds the first hit of each of many rays, in their order, with one range for all. Faster than
/// single calls, because several rays are processed in turn. `result` is overwritten; a reused
/// result allocates nothing on one thread.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count,
               const NonDeduced<RayRange<S>>& range, std::vector<RayHit<S>>& result);
/// On the whole rays.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count,
               std::vector<RayHit<S>>& result) {
  firstHits(mesh, origins, directions, count, RayRange<S>(), result);
}
/// From vectors or matrices, one direction for each origin.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& origins,
               const PointArray<NonDeduced<S>>& directions, const NonDeduced<RayRange<S>>& range,
               std::vector<RayHit<S>>& result) {
  firstHits(mesh, origins.data(), directions.data(),
            detail::commonSize(origins.size(), directions.size()), range, result);
}
/// On the whole rays.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& origins,
               const PointArray<NonDeduced<S>>& directions, std::vector<RayHit<S>>& result) {
  firstHits(mesh, origins, directions, RayRange<S>(), result);
}

/// Finds for each of many rays, in their order, whether it hits any triangle: 1 if it does, else 0.
/// Otherwise like firstHits.
template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
             const fcl::Vector3<S>* directions, std::size_t count,
             const NonDeduced<RayRange<S>>& range, std::vector<std::uint8_t>& result);
/// On the whole rays.
template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
             const fcl::Vector3<S>* directions, std::size_t count,
             std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins, directions, count, RayRange<S>(), result);
}
/// From vectors or matrices, one direction for each origin.
template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& origins,
             const PointArray<NonDeduced<S>>& directions, const NonDeduced<RayRange<S>>& range,
             std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins.data(), directions.data(),
          detail::commonSize(origins.size(), directions.size()), range, result);
}
/// On the whole rays.
template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const PointArray<NonDeduced<S>>& origins,
             const PointArray<NonDeduced<S>>& directions, std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins, directions, RayRange<S>(), result);
}

}  // namespace adaptive_bvh
