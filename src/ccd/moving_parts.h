#pragma once

#include <optional>

#include "solids/box.h"
#include "solids/flat.h"
#include "solids/solid_pair.h"

namespace adaptive_bvh {

/// A triangle, or a shape, whose points move on straight lines in the world from t = 0 to 1. A
/// plane and a half-space move with their normal n and offset d in n x = d, which change evenly.
class MovingPart {
 public:
  MovingPart(const TrianglePoints<double>& at_start, const TrianglePoints<double>& at_end)
      : start_(at_start), end_(at_end) {}
  /// Refers to the shape.
  MovingPart(const Solid& shape, const fcl::Transform3d& start_tf, const fcl::Transform3d& end_tf)
      : shape_(&shape), start_tf_(start_tf), end_tf_(end_tf) {}
  MovingPart(const BoxSolid& box, const fcl::Transform3d& start_tf, const fcl::Transform3d& end_tf)
      : box_(box), start_tf_(start_tf), end_tf_(end_tf) {}

  /// The farthest point at time t along a direction.
  fcl::Vector3d support(double t, const fcl::Vector3d& direction) const;
  /// At least the way of each point.
  double largestMotion() const;
  /// The largest coordinate at the start and the end, not of a flat shape.
  double extent() const;

  const FlatSolid* flat() const { return shape_ ? shape_->flat() : nullptr; }
  /// At the start, or at the end.
  PlacedSolid placed(bool at_end) const { return {*shape(), at_end ? end_tf_ : start_tf_}; }

 private:
  const Solid* shape() const { return box_ ? &*box_ : shape_; }
  /// At least the distance of each point of the shape from its origin.
  double radius() const;

  TrianglePoints<double> start_, end_;
  std::optional<BoxSolid> box_;
  const Solid* shape_ = nullptr;
  fcl::Transform3d start_tf_ = fcl::Transform3d::Identity(), end_tf_ = fcl::Transform3d::Identity();
};

/// A time up to which two parts are farther apart than a separation: that at which they come so
/// near, or an earlier one, at which they are nearer than the separation and 1e-12 of their
/// coordinates; Impact::kNever where they do not come so near up to `latest`. Never late, despite
/// rounding: docs/bounds.md, 15. `parallel`: as of gapOf.
double timeOfContact(const MovingPart& first, const MovingPart& second, double separation,
                     double latest, double parallel);

}  // namespace adaptive_bvh
