#pragma once

#include <array>

#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// Decides whether two triangles have a common point, exactly for the given numbers. Triangles are
/// closed, may be coplanar, and may be degenerate to segments or points. Keeps references to both.
class TriangleIntersection {
 public:
  TriangleIntersection(const TrianglePoints& a, const TrianglePoints& b);

  /// Whether the triangles have a common point.
  bool exists() const { return edges_ || is_in_plane_; }
  /// Whether an edge of one triangle crosses the plane of the other at a common point.
  bool isCrossing() const { return edges_; }
  /// If isCrossing(): that common point, up to rounding, as a point of each triangle.
  PointPair crossing() const;

 private:
  /// The sides of a face's plane on which three points lie, as orientations.
  using Sides = std::array<double, 3>;

  /// Finds an edge of the triangle `edges` that crosses the plane of `face` at a point of the face.
  /// `sides` are those of the corners of `edges`. Returns whether there is one.
  bool findCrossing(const TrianglePoints& edges, const TrianglePoints& face, const Sides& sides);

  const TrianglePoints &a_, &b_;
  const TrianglePoints* edges_ = nullptr;  ///< the triangle whose edge crosses the other
  std::size_t edge_ = 0;                   ///< first corner of that edge
  bool is_in_plane_ = false;               ///< a common point in the plane of both exists
};

/// Whether two triangles have a common point, decided exactly.
inline bool touch(const TrianglePoints& a, const TrianglePoints& b) {
  return TriangleIntersection(a, b).exists();
}

/// Whether two triangles have a common point beyond the corners that they share by index, or any
/// common point if they share no corner. Decided exactly for the given numbers. True for triangles
/// that share all three corners. A triangle without area, such as one that repeats a corner, has no
/// point beyond a shared corner. `of_p` and `of_q` are the corners' vertex indices.
bool meetBeyondShared(const TrianglePoints& p, const std::array<unsigned, 3>& of_p,
                      const TrianglePoints& q, const std::array<unsigned, 3>& of_q);

}  // namespace adaptive_bvh
