#pragma once

#include <algorithm>
#include <limits>

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh {

/// Brings aabb_local, aabb_center and aabb_radius up to date, as FCL's computeLocalAABB does.
template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model);

/// Sets box and centre.
template <typename BV>
void setLocalBox(fcl::BVHModel<BV>& model, const fcl::Vector3<typename BV::S>& low,
                 const fcl::Vector3<typename BV::S>& high);

/// The squared distance from the centre to the farthest vertex in [begin, end).
template <typename BV>
typename BV::S squaredRadius(const fcl::BVHModel<BV>& model, int begin, int end);

/// The same where a few vertices move, one by one. Looks at the others only where one moves that
/// the bounds rest on, or the box grows.
template <typename BV>
class PartialBounds {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;

  explicit PartialBounds(fcl::BVHModel<BV>& model)
      : model_(model), radius_(model.aabb_radius), nearly_(radius_ * (1 - 8 * epsilon())) {}

  /// Before the position is written.
  void move(const Point& from, const Point& to) {
    const fcl::AABB<S>& box = model_.aabb_local;
    for (int k = 0; k < 3; ++k)
      stale_ |= !(from[k] > box.min_[k] && from[k] < box.max_[k] && to[k] >= box.min_[k] &&
                  to[k] <= box.max_[k]);
    stale_ |= !((from - model_.aabb_center).norm() < nearly_);
    radius_ = std::max(radius_, (to - model_.aabb_center).norm());
  }
  /// After the last.
  void finish() {
    if (stale_)
      updateLocalBounds(model_);
    else
      model_.aabb_radius = radius_;
  }

 private:
  static constexpr S epsilon() { return std::numeric_limits<S>::epsilon(); }

  fcl::BVHModel<BV>& model_;
  S radius_, nearly_;
  bool stale_ = false;
};

}  // namespace adaptive_bvh
