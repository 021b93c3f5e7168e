#pragma once

#include <vector>

#include <fcl/common/types.h>

#include "hierarchy/vertex_slots.h"

namespace adaptive_bvh {

/// How a body has turned as a whole: the rotation that best fits the motions of a few of its
/// vertices (Kabsch 1976, "A solution for the best rotation to relate two sets of vectors").
/// Without it, the boxes of a body that tumbles, or that a robot carries around, would not stay
/// tight: they lie along axes of the body. Any answer is sound; a good one keeps the boxes tight.
class BestFitTurn {
 public:
  /// Begins anew, with the body as it stands with these `axes`. `scale` brings the body's size to
  /// about 1. Of its triangles another corner in turn: the first ones of long slivers may all lie
  /// on one line.
  void start(const fcl::Vector3d* positions, const VertexSlots& slots, const fcl::Matrix3d& axes,
             double scale);

  /// Replaces `axes`, those in use, when the body in these positions has turned away from them by
  /// more than 11 degrees. Looks only when the samples have moved against each other by a fortieth
  /// of their distances since it looked last. Returns whether it did.
  bool turn(const fcl::Vector3d* positions, fcl::Matrix3d& axes);

  static constexpr std::size_t kSamples = 12;
  /// A few vertices, spread over the body.
  using Vertices = Eigen::Matrix<unsigned, Eigen::Dynamic, 1, 0, int(kSamples), 1>;
  const Vertices& samples() const { return vertices_; }

 private:
  using Samples = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, int(kSamples)>;

  Samples samplesOf(const fcl::Vector3d* positions) const;
  bool turn(const Samples& now, fcl::Matrix3d& axes);

  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  double scale_ = 1;
  Vertices vertices_;
  Samples rest_, last_;  ///< at the start, and when it looked last
};

/// The axes along which the boxes of a body lie: its principal axes, or those of its frame where
/// boxes along these are about as small. They turn with the body.
class BodyAxes {
 public:
  /// Chooses the axes of a body.
  void start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots);
  /// Begins with these.
  void start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots,
             const fcl::Matrix3d& axes);

  const fcl::Matrix3d& axes() const { return axes_; }

  /// Turns the axes with the body (BestFitTurn::turn).
  bool turn(const std::vector<fcl::Vector3d>& vertices) {
    return turn_.turn(vertices.data(), axes_);
  }

 private:
  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  BestFitTurn turn_;
};

}  // namespace adaptive_bvh
