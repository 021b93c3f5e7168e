#pragma once

#include <cstddef>
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
  int triangle;           ///< that has it; one of them, where several do
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

/// Where a ray meets a triangle: at origin + t * direction.
template <typename S>
struct RayHit {
  S t;           ///< >= 0 and not -0; infinite where the ray meets nothing
  int triangle;  ///< -1 where the ray meets nothing
  S u;           ///< the point is (1 - u - v) a + u b + v c of the triangle's corners a, b, c
  S v;           ///< as u
};

/// Every triangle that a ray meets, by increasing t; of equal t the smaller index first.
/// `direction` has any length. Whether a ray meets a triangle is decided without rounding, for the
/// numbers as they are given. Sides and corners belong to each triangle that has them, so a ray
/// cannot slip between two neighbours. A ray starts on a triangle, at t = 0, when its origin lies
/// exactly in the triangle's plane; an origin that is computed may lie on either side of it. A
/// triangle in whose plane the ray lies is not met, nor is one at a t that S cannot hold. `result`
/// is overwritten. Returns the number of hits.
template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                    const fcl::Vector3<S>& direction, std::vector<RayHit<S>>& result);

/// The first hit of rayHits.
template <typename S>
RayHit<S> firstHit(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                   const fcl::Vector3<S>& direction);

/// The first hit of each of many rays, in their order. `result` is overwritten.
template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count,
               std::vector<RayHit<S>>& result);

}  // namespace adaptive_bvh
