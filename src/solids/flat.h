#pragma once

#include <limits>

#include "solids/solid.h"

namespace adaptive_bvh {

/// A half-space, n x <= d, or a plane, n x = d. n has length 1.
class FlatSolid final : public Solid {
 public:
  /// `n` may have any length; n and d are divided by it. `is_solid` makes a half-space.
  FlatSolid(const fcl::Vector3d& n, double d, bool is_solid)
      : n_(n / n.norm()), d_(d / n.norm()), is_solid_(is_solid) {}

  /// A point at infinity along the direction.
  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return direction * std::numeric_limits<double>::infinity();
  }
  ShapeCore core() const override;
  TriangleGap gap(const TrianglePoints& triangle) const override;
  Penetration penetration(const TrianglePoints& triangle) const override;
  /// A plane has no inside: the outward direction points from the plane to x, and is n for points
  /// on it.
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  /// A line parallel to a half-space's plane is inside entirely or not at all; a line parallel to a
  /// plane does not intersect it.
  LineInterval lineInside(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& patches) const override;
  const FlatSolid* flat() const override { return this; }

  const fcl::Vector3d& normal() const { return n_; }
  double offset() const { return d_; }
  bool isSolid() const { return is_solid_; }

 private:
  /// The corners that are lowest and highest above the plane n x = d, and their heights.
  struct Extremes {
    std::size_t lowest, highest;
    double low, high;
  };
  Extremes extremes(const TrianglePoints& triangle) const;

  const fcl::Vector3d n_;
  const double d_;
  const bool is_solid_;  ///< a half-space, not a plane
};

}  // namespace adaptive_bvh
