#pragma once

#include "mesh/mesh_view.h"
#include "triangles/orientation.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {

/// The orientation of three points, seen along axis k.
inline int orientationAlong(int k, const fcl::Vector3d& a, const fcl::Vector3d& b,
                            const fcl::Vector3d& c) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  return planarOrientation(a[i], a[j], b[i], b[j], c[i], c[j]);
}

inline bool hasArea(const TrianglePoints<double>& t) {
  for (int k = 0; k < 3; ++k)
    if (orientationAlong(k, t[0], t[1], t[2]) != 0) return true;
  return false;
}

/// Whether two triangles have a common point beyond the corners that they share by index; of those
/// that share no corner, whether they have a common point. Decided without any error for the
/// numbers as they are given. Triangles that share all corners have. A triangle without area, which
/// one that repeats a corner is, has no point beyond a shared corner.
///
/// One shared corner v, triangles v a b and v c d: their common points are a convex set. A ray from
/// v through another one of them leaves one triangle first, and through the side that v is not on.
/// So they have another one if and only if the segment a b meets v c d, or c d meets v a b.
///
/// Two, u and v, with the other corners a and b: planes that differ have only the line u v in
/// common. In one plane, the triangles overlap beside that line where a and b are on one side of
/// it.
inline bool meetBeyondShared(const TrianglePoints<double>& p, const VertexIndices& of_p,
                             const TrianglePoints<double>& q, const VertexIndices& of_q) {
  std::size_t shared = 0, own_p[3], own_q[3], num_p = 0, num_q = 0, in_p[3] = {0, 0, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    const bool is_shared = of_p[i] == of_q[0] || of_p[i] == of_q[1] || of_p[i] == of_q[2];
    if (is_shared)
      in_p[shared++] = i;
    else
      own_p[num_p++] = i;
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (of_q[i] != of_p[0] && of_q[i] != of_p[1] && of_q[i] != of_p[2]) own_q[num_q++] = i;
  if (shared == 0) return TriangleIntersection(p, q).exists();
  if (!hasArea(p) || !hasArea(q)) return false;
  if (shared == 3) return true;
  if (shared == 2) {
    const fcl::Vector3d &u = p[in_p[0]], &v = p[in_p[1]], &a = p[own_p[0]], &b = q[own_q[0]];
    if (orientation(u, v, a, b) != 0) return false;
    for (int k = 0; k < 3; ++k)
      if (orientationAlong(k, u, v, a) * orientationAlong(k, u, v, b) > 0) return true;
    return false;
  }
  const TrianglePoints<double> across_p = {p[own_p[0]], p[own_p[1]], p[own_p[1]]},
                               across_q = {q[own_q[0]], q[own_q[1]], q[own_q[1]]};
  return TriangleIntersection(across_p, q).exists() || TriangleIntersection(across_q, p).exists();
}

}  // namespace adaptive_bvh
