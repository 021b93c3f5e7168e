#pragma once

#include <vector>

#include <fcl/common/types.h>

#include "hierarchy/vertex_slots.h"

namespace adaptive_bvh {

/// Estimates the rotation of a body as a whole: the rotation that best fits the motions of a few of
/// its vertices (Kabsch 1976, "A solution for the best rotation to relate two sets of vectors").
/// A mesh's boxes are aligned with axes that this rotation carries along, so that the boxes of a
/// body that tumbles, or that a robot carries, stay tight. Any rotation gives correct answers.
class BestFitRotation {
 public:
  /// Restarts with the body's current positions and `axes`. `scale` brings the body's size to about
  /// 1.
  void start(const fcl::Vector3d* positions, const VertexSlots& slots, const fcl::Matrix3d& axes,
             double scale);

  /// Sets `axes`, the axes in use, to the rotated ones if both differ by more than 11 degrees.
  /// Computes the rotation only if the samples have moved relative to each other by a fortieth of
  /// their distances since the last computation. Returns whether `axes` changed.
  bool update(const fcl::Vector3d* positions, fcl::Matrix3d& axes);

  const VertexSlots::Samples& samples() const { return vertices_; }

 private:
  using Samples = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, VertexSlots::kSamples>;

  Samples samplesOf(const fcl::Vector3d* positions) const;

  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();  ///< at the start
  double scale_ = 1;
  VertexSlots::Samples vertices_;
  Samples start_, last_;  ///< positions of vertices_ at the start, and at the last computation
};

/// The axes along which the boxes of a body are aligned. They start as its principal axes, or as
/// the axes of its frame if a box along these is about as small, and rotate with the body.
class BodyAxes {
 public:
  /// Chooses the axes for a body.
  void start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots);
  /// Starts with given axes.
  void start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots,
             const fcl::Matrix3d& axes);

  const fcl::Matrix3d& axes() const { return axes_; }

  /// Rotates the axes with the body (BestFitRotation::update). Returns whether they changed.
  bool update(const std::vector<fcl::Vector3d>& vertices) {
    return rotation_.update(vertices.data(), axes_);
  }

 private:
  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  BestFitRotation rotation_;
};

}  // namespace adaptive_bvh
