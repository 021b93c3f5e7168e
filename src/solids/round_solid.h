#pragma once

#include "solids/solid.h"

namespace adaptive_bvh {

/// A shape whose distance to a triangle is computed through `surface`.
class RoundSolid : public Solid {
 public:
  TriangleGap gap(const TrianglePoints<double>& triangle) const final;

 private:
  /// Finds the point of an edge nearest to the shape; returns false if it is inside.
  bool considerEdge(const fcl::Vector3d& from, const fcl::Vector3d& to, TriangleGap& best) const;
  /// Finds the nearest point of the shape to the triangle's interior; returns false if the two
  /// intersect.
  bool considerFace(const TrianglePoints<double>& triangle, TriangleGap& best) const;
};

}  // namespace adaptive_bvh
