#pragma once

#include <limits>

#include "solids/solid.h"

namespace adaptive_bvh {

/// All x with n x <= d, or with n x = d, a plane. n has length 1.
class FlatSolid final : public Solid {
 public:
  /// `n` has any length; n and d are divided by it.
  FlatSolid(const fcl::Vector3d& n, double d, bool is_solid)
      : n_(n / n.norm()), d_(d / n.norm()), is_solid_(is_solid) {}

  /// Infinite.
  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return direction * std::numeric_limits<double>::infinity();
  }
  ShapeCore core() const override;
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  Penetration penetration(const TrianglePoints<double>& triangle) const override;
  /// The plane has no inside: its direction points away from it, and is n for points on it.
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  /// A line along the plane of a half-space is in it as a whole or not at all; one along a plane
  /// does not meet it.
  LineInterval along(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& patches) const override;
  const FlatSolid* flat() const override { return this; }

  const fcl::Vector3d& normal() const { return n_; }
  double offset() const { return d_; }
  bool isSolid() const { return is_solid_; }

 private:
  /// Which corners are the lowest and the highest above the plane n x = d, and how high.
  struct Extremes {
    std::size_t lowest, highest;
    double low, high;
  };
  Extremes extremes(const TrianglePoints<double>& triangle) const;

  const fcl::Vector3d n_;
  const double d_;
  const bool is_solid_;
};

}  // namespace adaptive_bvh
