#pragma once

#include <vector>

#include "mesh/best_fit_turn.h"

namespace adaptive_bvh {

/// The axes along which the boxes of a body lie: its principal axes, or those of its frame where
/// boxes along these are about as small. They turn with the body.
class BodyAxes {
 public:
  /// Chooses the axes of a body.
  template <typename S>
  void start(const std::vector<fcl::Vector3<S>>& vertices, const VertexSlots& slots);

  const fcl::Matrix3d& axes() const { return axes_; }

  /// Turns the axes with the body (BestFitTurn::turn).
  template <typename S>
  bool turn(const std::vector<fcl::Vector3<S>>& vertices) {
    return turn_.turn(vertices.data(), axes_);
  }

  std::size_t bytes() const { return turn_.bytes(); }

 private:
  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  BestFitTurn turn_;
};

}  // namespace adaptive_bvh
