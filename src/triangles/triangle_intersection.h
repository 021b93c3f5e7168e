#pragma once

#include <array>

#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// Whether two triangles have a common point: decided without any error for the numbers as they are
/// given. Triangles are closed, may lie in one plane, and may be segments or points. Refers to
/// both.
class TriangleIntersection {
 public:
  TriangleIntersection(const TrianglePoints<double>& a, const TrianglePoints<double>& b);

  bool exists() const { return edges_ || is_in_plane_; }
  /// Whether an edge of one triangle leaves the plane of the other where it meets it.
  bool isCrossing() const { return edges_; }
  /// Where it does: a common point, up to rounding, as each triangle has it.
  PointPair<double> crossing() const;

 private:
  /// The sides of a face's plane on which three points are, by orientation.
  using Sides = std::array<double, 3>;

  bool findCrossing(const TrianglePoints<double>& edges, const TrianglePoints<double>& face,
                    const Sides& sides);

  const TrianglePoints<double>&a_, &b_;
  const TrianglePoints<double>* edges_ = nullptr;  ///< the triangle whose edge crosses the other
  std::size_t edge_ = 0;                           ///< from this corner to the next
  bool is_in_plane_ = false;
};

inline bool touch(const TrianglePoints<double>& a, const TrianglePoints<double>& b) {
  return TriangleIntersection(a, b).exists();
}

/// Whether two triangles have a common point beyond the corners that they share by index; of those
/// that share no corner, whether they have a common point. Decided without any error for the
/// numbers as they are given. Triangles that share all corners have. A triangle without area, which
/// one that repeats a corner is, has no point beyond a shared corner.
bool meetBeyondShared(const TrianglePoints<double>& p, const std::array<unsigned, 3>& of_p,
                      const TrianglePoints<double>& q, const std::array<unsigned, 3>& of_q);

}  // namespace adaptive_bvh
