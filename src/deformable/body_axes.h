#pragma once

#include <vector>

#include <fcl/common/types.h>

#include "hierarchy/vertex_slots.h"

namespace adaptive_bvh {

/// Estimates the rotation of a body as a whole: the rotation that best fits the motions of a few of
/// its vertices (Kabsch 1976, "A solution for the best rotation to relate two sets of vectors").
/// The boxes lie along axes of the body. Without this rotation, the boxes of a body that tumbles,
/// or that a robot carries, would not stay tight. Any rotation gives correct answers; a good one
/// keeps the boxes tight.
class BestFitTurn {
 public:
  /// Restarts with the body's current positions and `axes`. `scale` brings the body's size to about
  /// 1. Samples a different corner of successive triangles: the first corners of long slivers may
  /// be collinear.
  void start(const fcl::Vector3d* positions, const VertexSlots& slots, const fcl::Matrix3d& axes,
             double scale);

  /// Updates `axes`, the axes in use, if the body has rotated by more than 11 degrees relative to
  /// them. Computes the rotation only if the samples have moved relative to each other by a
  /// fortieth of their distances since the last computation. Returns whether `axes` changed.
  bool turn(const fcl::Vector3d* positions, fcl::Matrix3d& axes);

  static constexpr std::size_t kSamples = 12;
  /// Indices of a few vertices, spread over the body.
  using Vertices = Eigen::Matrix<unsigned, Eigen::Dynamic, 1, 0, int(kSamples), 1>;
  const Vertices& samples() const { return vertices_; }

 private:
  using Samples = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, int(kSamples)>;

  Samples samplesOf(const fcl::Vector3d* positions) const;
  bool turn(const Samples& now, fcl::Matrix3d& axes);

  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  double scale_ = 1;
  Vertices vertices_;
  Samples rest_, last_;  ///< samples at the start, and at the last computation
};

/// The axes along which the boxes of a body are aligned: its principal axes, or those of its frame
/// if boxes along these are about as small. They rotate with the body.
class BodyAxes {
 public:
  /// Chooses the axes for a body.
  void start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots);
  /// Starts with given axes.
  void start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots,
             const fcl::Matrix3d& axes);

  const fcl::Matrix3d& axes() const { return axes_; }

  /// Rotates the axes with the body (BestFitTurn::turn). Returns whether they changed.
  bool turn(const std::vector<fcl::Vector3d>& vertices) {
    return turn_.turn(vertices.data(), axes_);
  }

 private:
  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  BestFitTurn turn_;
};

}  // namespace adaptive_bvh
