#pragma once

#include "solids/solid.h"

namespace adaptive_bvh {

/// All points within `radius` of the segment from -half to half on the z axis: a capsule, or a
/// sphere if half is 0.
class RoundedSegment final : public Solid {
 public:
  RoundedSegment(double radius, double half) : radius_(radius), half_(half) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return fcl::Vector3d(0, 0, direction[2] < 0 ? -half_ : half_) +
           radius_ * direction.stableNormalized();
  }
  ShapeCore core() const override { return ShapeCore::around({0, 0, half_}, radius_); }
  TriangleGap gap(const TrianglePoints& triangle) const override;
  bool touches(const TrianglePoints& triangle, ShapeContact& contact) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  LineInterval lineInside(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& to) const override;
  double rollingRadius() const override { return radius_; }
  const RoundedSegment* roundedSegment() const override { return this; }

  double radius() const { return radius_; }
  /// The upper end of the segment; the lower end is its negative.
  fcl::Vector3d end() const { return {0, 0, half_}; }

 private:
  /// The gap of the triangle and the segment.
  TriangleGap coreGap(const TrianglePoints& triangle) const;

  const double radius_, half_;
};

}  // namespace adaptive_bvh
