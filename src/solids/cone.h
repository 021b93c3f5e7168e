#pragma once

#include "solids/round_solid.h"

namespace adaptive_bvh {

/// A cone around the z axis, with its base at -half and its tip at half.
class ConeSolid final : public RoundSolid {
 public:
  ConeSolid(double radius, double half) : radius_(radius), half_(half) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override;
  Penetration penetration(const TrianglePoints& triangle) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  LineInterval lineInside(const Line& given) const override;
  void addPatches(std::vector<SurfacePatch>& to) const override;

 private:
  const double radius_, half_;
};

}  // namespace adaptive_bvh
