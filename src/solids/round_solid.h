#pragma once

#include "solids/solid.h"

namespace adaptive_bvh {

/// A shape whose distance to a triangle is computed through `surface` and `support`. The functions
/// below keep the nearest points so far in `best`; its first point is on the triangle.
class RoundSolid : public Solid {
 public:
  TriangleGap gap(const TrianglePoints& triangle) const final;

 private:
  /// Considers the point of an edge nearest to the shape. Returns false if it is inside.
  bool considerEdge(const fcl::Vector3d& from, const fcl::Vector3d& to, TriangleGap& best) const;
  /// Considers the point of the shape nearest to the triangle's interior, if no edge intersects the
  /// shape. Returns false if the interior does.
  bool considerFace(const TrianglePoints& triangle, TriangleGap& best) const;
};

}  // namespace adaptive_bvh
