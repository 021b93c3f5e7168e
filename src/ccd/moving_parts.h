#pragma once

#include <optional>

#include "solids/box.h"
#include "solids/flat.h"
#include "solids/solid_pair.h"

namespace adaptive_bvh {

/// A triangle or shape whose points move on straight lines in the world from t = 0 to 1. (Of a
/// plane or half-space n x = d, the normal n and the offset d are interpolated linearly instead.)
class MovingPart {
 public:
  MovingPart(const TrianglePoints<double>& at_start, const TrianglePoints<double>& at_end)
      : start_(at_start), end_(at_end) {}
  /// Refers to the shape.
  MovingPart(const Solid& shape, const fcl::Transform3d& start_tf, const fcl::Transform3d& end_tf)
      : shape_(&shape), start_tf_(start_tf), end_tf_(end_tf) {}
  /// Copies the box.
  MovingPart(const BoxSolid& box, const fcl::Transform3d& start_tf, const fcl::Transform3d& end_tf)
      : box_(box), start_tf_(start_tf), end_tf_(end_tf) {}

  /// The farthest point at time t along a direction.
  fcl::Vector3d support(double t, const fcl::Vector3d& direction) const;
  /// Upper bound of the length of each point's motion.
  double largestMotion() const;
  /// Upper bound of the distance of points from the origin; not for a plane or half-space.
  double extent() const;

  /// The plane or half-space; null for other parts.
  const FlatSolid* flat() const { return shape_ ? shape_->flat() : nullptr; }
  /// The shape at the start or the end.
  PlacedSolid placed(bool at_end) const { return {*shape(), at_end ? end_tf_ : start_tf_}; }

 private:
  const Solid* shape() const { return box_ ? &*box_ : shape_; }
  /// Upper bound of the distance of the shape's points from its origin.
  double radius() const;

  TrianglePoints<double> start_, end_;  ///< corners, if there is no shape
  std::optional<BoxSolid> box_;
  const Solid* shape_ = nullptr;  ///< a shape that is not box_; null for a triangle
  fcl::Transform3d start_tf_ = fcl::Transform3d::Identity(), end_tf_ = fcl::Transform3d::Identity();
};

/// Returns the time at which the distance of two parts falls to `separation`, or Impact::kNever if
/// it does not until `latest`. Despite rounding it is never late. It may be early: the distance is
/// then less than the separation plus 1e-12 of the coordinates. docs/bounds.md, 15. `parallel`: the
/// largest sine of the angle of directions that count as parallel.
double timeOfContact(const MovingPart& first, const MovingPart& second, double separation,
                     double latest, double parallel);

}  // namespace adaptive_bvh
