#pragma once

#include "solids/solid.h"

namespace adaptive_bvh {

/// A shape whose distance to a triangle is found by its surface.
class RoundSolid : public Solid {
 public:
  TriangleGap gap(const TrianglePoints<double>& triangle) const final;

 private:
  /// The nearest point of an edge; false where it is inside.
  bool considerEdge(const fcl::Vector3d& from, const fcl::Vector3d& to, TriangleGap& best) const;
  /// The part of the set that is nearest to the triangle's plane; false where it meets the
  /// triangle.
  bool considerFace(const TrianglePoints<double>& triangle, TriangleGap& best) const;
};

}  // namespace adaptive_bvh
