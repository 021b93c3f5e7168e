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

}  // namespace adaptive_bvh
