#pragma once

#include "solids/solid.h"

namespace adaptive_bvh {

/// An axis-aligned box around the origin, given by half its side lengths.
class BoxSolid final : public Solid {
 public:
  explicit BoxSolid(const fcl::Vector3d& half) : half_(half) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return direction.unaryExpr([](double c) { return c < 0 ? -1. : 1.; }).cwiseProduct(half_);
  }
  ShapeCore core() const override { return ShapeCore::around(half_); }
  TriangleGap gap(const TrianglePoints& triangle) const override;
  Penetration penetration(const TrianglePoints& triangle) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  LineInterval lineInside(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& patches) const override;

 private:
  const fcl::Vector3d half_;
};

}  // namespace adaptive_bvh
