#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// \file
/// Points and rays against a deforming mesh in its present state: nothing is rebuilt. Everything
/// is in the mesh's own frame and unit, and computed in double precision for meshes of either
/// precision.
///
/// Coordinates of points may be as large as those of a mesh (deformable_mesh.h).
///
/// **Errors.** std::invalid_argument when a number is not finite, a direction is zero, a distance
/// is negative or NaN.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query of many takes several threads
/// itself where DeformableMesh::setQueryThreads says so.

/// The point of a surface that is nearest to a point.
template <typename S>
struct ClosestPoint {
  fcl::Vector3<S> point;  ///< on the surface
  S distance;             ///< from the point that was asked for
  int triangle;           ///< that has it; the smallest index, where several do
};

/// The nearest point of the mesh's triangles. The distance is exact up to rounding: 2^-48 (4e-15)
/// of the largest distance of `point` to a corner of the triangle.
template <typename S>
ClosestPoint<S> closestPoint(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& point);

/// Of many points, in their order. `result` is overwritten; one that is used again allocates
/// nothing. Points that follow each other are best near each other.
template <typename S>
void closestPoints(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                   std::vector<ClosestPoint<S>>& result);
/// From a vector.
template <typename S>
void closestPoints(const DeformableMesh<S>& mesh, const std::vector<fcl::Vector3<S>>& points,
                   std::vector<ClosestPoint<S>>& result) {
  closestPoints(mesh, points.data(), points.size(), result);
}

/// What a point of a surface lies on.
enum class SurfaceFeature {
  Face,    ///< inside a triangle
  Edge,    ///< between two corners
  Vertex,  ///< a corner
};

/// The nearest point of a surface, and what of the surface it lies on.
template <typename S>
struct ClosestFeature {
  fcl::Vector3<S> point;  ///< on the surface; NaN where none is within the limit
  S distance;             ///< from the point that was asked for; infinite where there is none
  int triangle;           ///< that has it, the one with the smallest index; -1 where there is none
  fcl::Vector3<S> barycentric;  ///< of the point, for the triangle's corners
  SurfaceFeature feature;       ///< whether it is inside the triangle, on an edge or a corner
  /// Of the triangle, the edge (as numbered in feature_pairs.h) or the vertex.
  unsigned number;
  /// The outward direction there, of length 1: of the triangle; on an edge the mean of its
  /// triangles; on a vertex their mean weighted by their angles (VertexContacts::normals). Zero
  /// where no triangle there has an area. Triangles are taken to face outward.
  fcl::Vector3<S> normal;
};

/// As closestPoints, of points on the surface that are at most `limit` away. The result is the same
/// whatever the number of threads.
template <typename S>
void closestFeatures(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points,
                     std::size_t count, S limit, std::vector<ClosestFeature<S>>& result);
/// From a vector.
template <typename S>
void closestFeatures(const DeformableMesh<S>& mesh, const std::vector<fcl::Vector3<S>>& points,
                     S limit, std::vector<ClosestFeature<S>>& result) {
  closestFeatures(mesh, points.data(), points.size(), limit, result);
}

/// The distances of many points to the surface, negative inside; trimesh's `signed_distance` is
/// positive there. A point is inside where the surface winds around it (the winding number is not
/// 0), which is decided without any error. Distances as those of closestPoint. `result` is
/// overwritten; one that is used again allocates nothing on one thread. Throws
/// std::invalid_argument also when the mesh is not closed; the message names an edge.
template <typename S>
void signedDistances(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points,
                     std::size_t count, std::vector<S>& result);
/// From a vector.
template <typename S>
void signedDistances(const DeformableMesh<S>& mesh, const std::vector<fcl::Vector3<S>>& points,
                     std::vector<S>& result) {
  signedDistances(mesh, points.data(), points.size(), result);
}

/// How often the triangles wind around each of many points: of a closed surface a whole number, 0
/// outside, without any error (on the surface, 0 or that of one side); of open meshes and soups the
/// generalised winding number, the sum of their solid angles divided by 4 pi, which is near 1 well
/// inside (Jacobson, Kavan, Sorkine-Hornung 2013). That is off by at most `tolerance` and by
/// rounding: triangles far away are taken together, by bounded moments of their areas. The smaller
/// it is, the longer it takes; at 0 every triangle counts by itself. What is rounded is that to S,
/// 1e-14 for each triangle that counts by itself, and where the point is h away from an edge of one
/// of size L, 1e-18 (L / h)^2 (with the long double of x86). `result` is overwritten. Throws
/// std::invalid_argument also when the tolerance is negative or NaN.
template <typename S>
void windingNumbers(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                    S tolerance, std::vector<S>& result);
/// From a vector.
template <typename S>
void windingNumbers(const DeformableMesh<S>& mesh, const std::vector<fcl::Vector3<S>>& points,
                    S tolerance, std::vector<S>& result) {
  windingNumbers(mesh, points.data(), points.size(), tolerance, result);
}

/// An edge that the triangles that share it run through more often in one direction.
struct OpenEdge {
  unsigned from;      ///< the vertex where it begins, in that direction
  unsigned to;        ///< the vertex where it ends
  unsigned triangle;  ///< with the smallest index that has the edge
  int surplus;        ///< how much more often; 1 on a boundary
};

/// Whether a mesh encloses something: every edge is run through as often in one direction as in the
/// other by the triangles that share it. So triangles face the same side, too. Vertices are
/// compared by index (weldVertices). If `open_edges` is given, it is overwritten with all edges
/// that are not, by increasing triangle; else the answer is known since the build.
template <typename S>
bool isWatertight(const DeformableMesh<S>& mesh, std::vector<OpenEdge>* open_edges = nullptr);

/// Where a ray meets a triangle: at origin + t * direction.
template <typename S>
struct RayHit {
  S t;           ///< >= 0 and not -0; infinite where the ray meets nothing
  int triangle;  ///< -1 where the ray meets nothing
  S u;           ///< the point is (1 - u - v) a + u b + v c of the triangle's corners a, b, c
  S v;           ///< as u
};

/// The part of a ray in which hits count: where begin <= RayHit::t <= end, with the numbers as they
/// are returned, rounded to S. Both ends belong to it, so the segment from `origin` to `origin` +
/// `direction` is {0, 1}; shadow rays that start on a surface begin a little above 0.
template <typename S>
struct RayRange {
  S begin = 0;                                 ///< not negative
  S end = std::numeric_limits<S>::infinity();  ///< `begin` or more
};

/// Every triangle that a ray meets, by increasing t; of equal t the smaller index first.
/// `direction` has any length. Whether a ray meets a triangle is decided without rounding, for the
/// numbers as they are given. Sides and corners belong to each triangle that has them, so a ray
/// cannot slip between two neighbours. A ray starts on a triangle, at t = 0, when its origin lies
/// exactly in the triangle's plane; an origin that is computed may lie on either side of it. A
/// triangle in whose plane the ray lies is not met, nor is one at a t that S cannot hold. `result`
/// is overwritten. Returns the number of hits. Throws std::invalid_argument also when the range
/// is NaN, begins below 0, or ends before it begins.
template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                    const fcl::Vector3<S>& direction, const RayRange<S>& range,
                    std::vector<RayHit<S>>& result);
/// On the whole ray.
template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                    const fcl::Vector3<S>& direction, std::vector<RayHit<S>>& result) {
  return rayHits(mesh, origin, direction, RayRange<S>(), result);
}

/// The first hit of rayHits.
template <typename S>
RayHit<S> firstHit(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                   const fcl::Vector3<S>& direction, const RayRange<S>& range = RayRange<S>());

/// Whether rayHits finds any (occlusion). Stops at the first triangle that it finds.
template <typename S>
bool anyHit(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
            const fcl::Vector3<S>& direction, const RayRange<S>& range = RayRange<S>());

/// firstHit of each of many rays, in their order, with one range for all. Faster than one by one:
/// rays take turns. `result` is overwritten; one that is used again allocates nothing on one
/// thread.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count, const RayRange<S>& range,
               std::vector<RayHit<S>>& result);
/// On the whole rays.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count,
               std::vector<RayHit<S>>& result) {
  firstHits(mesh, origins, directions, count, RayRange<S>(), result);
}

/// anyHit of each of many rays, as firstHits: 1 where there is a hit, else 0.
template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
             const fcl::Vector3<S>* directions, std::size_t count, const RayRange<S>& range,
             std::vector<std::uint8_t>& result);
/// On the whole rays.
template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
             const fcl::Vector3<S>* directions, std::size_t count,
             std::vector<std::uint8_t>& result) {
  anyHits(mesh, origins, directions, count, RayRange<S>(), result);
}

}  // namespace adaptive_bvh
