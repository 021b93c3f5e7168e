#pragma once

#include <vector>

#include <fcl/common/types.h>

#include "mesh/vertex_slots.h"

namespace adaptive_bvh {

/// The axes along which the boxes of a body lie: its principal axes, or those of its frame where
/// boxes along these are about as small. They turn with the body: else the boxes of one that
/// tumbles, or that a robot carries around, would not stay tight. Any answer is sound.
///
/// How a body has turned as a whole: the rotation that best fits the motions of a few of its
/// vertices (Kabsch 1976, "A solution for the best rotation to relate two sets of vectors").
class BodyAxes {
 public:
  /// Chooses the axes of a body.
  template <typename S>
  void start(const std::vector<fcl::Vector3<S>>& vertices, const VertexSlots& slots);

  const fcl::Matrix3d& axes() const { return axes_; }

  /// Turns the axes with the body when it has turned away from them by more than 11 degrees. Looks
  /// only when the samples have moved against each other by a fortieth of their distances since it
  /// looked last. Returns whether it did.
  template <typename S>
  bool turn(const std::vector<fcl::Vector3<S>>& vertices);

  std::size_t bytes() const { return samples_.capacity() * sizeof(samples_[0]); }

 private:
  static constexpr std::size_t kSamples = 12;
  using Samples = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, int(kSamples)>;

  template <typename S>
  Samples samplesOf(const std::vector<fcl::Vector3<S>>& vertices) const;
  bool turn(const Samples& now);

  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity(), rest_axes_ = axes_;
  double scale_ = 1;
  std::vector<unsigned> samples_;  ///< vertices, spread over the body
  Samples rest_, last_;            ///< at the start, and when it looked last
};

}  // namespace adaptive_bvh
