#pragma once

#include "solids/round_solid.h"

namespace adaptive_bvh {

/// A cylinder around the z axis, from -half to half.
class CylinderSolid final : public RoundSolid {
 public:
  CylinderSolid(double radius, double half) : radius_(radius), half_(half) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override;
  Penetration penetration(const TrianglePoints& triangle) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  LineInterval lineInside(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& to) const override;

 private:
  const double radius_, half_;
};

}  // namespace adaptive_bvh
