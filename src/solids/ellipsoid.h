#pragma once

#include "solids/round_solid.h"

namespace adaptive_bvh {

/// An ellipsoid around the origin with its axes along the coordinate axes.
class EllipsoidSolid final : public RoundSolid {
 public:
  explicit EllipsoidSolid(const fcl::Vector3d& radii) : radii_(radii) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override;
  Penetration penetration(const TrianglePoints& triangle) const override;
  /// By D. Eberly's equation ("Distance from a Point to an Ellipse, an Ellipsoid, or a
  /// Hyperellipsoid"), which is accurate for all shapes and points.
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  LineInterval lineInside(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& patches) const override;
  /// The least radius of curvature (Blaschke's rolling theorem).
  double rollingRadius() const override {
    return radii_.minCoeff() * (radii_.minCoeff() / radii_.maxCoeff());
  }

 private:
  const fcl::Vector3d radii_;
};

}  // namespace adaptive_bvh
