#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/SVD>

#include "tree/topology.h"

namespace adaptive_bvh {

/// How a body has turned as a whole since its boxes were built: the rotation that best fits the
/// motions of a few of its vertices (Kabsch 1976, "A solution for the best rotation to relate two
/// sets of vectors"). Without it, the boxes of a body that tumbles, or that a robot carries around,
/// would not stay tight: they lie along axes of the body. Any answer is sound; a good one keeps the
/// boxes tight.
template <typename S>
class BestFitRotation {
 public:
  using Point = fcl::Vector3<S>;
  static constexpr std::size_t kSamples = 12;

  /// Begins anew, with the body as it stands in a frame with these `axes`. Of its triangles another
  /// corner in turn: the first ones of long slivers may all lie on one line.
  template <typename BV>
  void start(const fcl::BVHModel<BV>& model, const Topology& topology, const fcl::Matrix3d& axes,
             S scale) {
    axes_ = axes;
    scale_ = static_cast<double>(scale);
    vertices_.clear();
    const std::size_t primitives = topology.slots.leaves();  // in leaf order: near ones together
    const std::size_t count = std::min<std::size_t>(kSamples, primitives);
    vertices_.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
      vertices_.push_back(topology.slots.verticesOf(i * primitives / count)[i % 3]);
    rest_ = last_ = samplesOf(model.vertices, model.aabb_center);
  }

  /// Replaces `axes`, those in use, when the body in these positions has turned away from them by
  /// more than 11 degrees. Looks only when the samples have moved against each other by a fortieth
  /// of their distances since it looked last. Returns whether it did. `near`: some point near the
  /// body.
  bool turn(const Point* positions, const Point& near, fcl::Matrix3d& axes) {
    const Samples now = samplesOf(positions, near);
    if (!((now - last_).squaredNorm() > kMoved * rest_.squaredNorm())) return false;
    last_ = now;
    const Eigen::JacobiSVD<fcl::Matrix3d> svd(now * rest_.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
    const auto& sizes = svd.singularValues();
    if (!(sizes[1] > kFlat * sizes[0])) return false;  // on one line: no rotation
    // Equal when the motion is rigid, by Cauchy and Schwarz. A body that bends does not turn as a
    // whole.
    if (!(sizes.sum() > kRigid * now.norm() * rest_.norm())) return false;
    fcl::Matrix3d u = svd.matrixU();
    if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
    const fcl::Matrix3d turned = u * svd.matrixV().transpose() * axes_;
    const double cosine = ((turned.transpose() * axes).trace() - 1) / 2;
    if (!(cosine < kCosine)) return false;
    axes = turned;
    return true;
  }

  /// A few vertices, spread over the body.
  const std::vector<unsigned>& samples() const { return vertices_; }

  std::size_t bytes() const { return vertices_.capacity() * sizeof(vertices_[0]); }

 private:
  static constexpr double kMoved = 1. / 1600;
  static constexpr double kFlat = 1e-4;
  static constexpr double kRigid = 0.999;
  static constexpr double kCosine = 0.98;  // 11 degrees

  using Samples = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, int(kSamples)>;

  /// The samples relative to their middle, in body units.
  Samples samplesOf(const Point* positions, const Point& near) const {
    Samples samples(3, Eigen::Index(vertices_.size()));
    for (std::size_t i = 0; i < vertices_.size(); ++i)
      samples.col(Eigen::Index(i)) =
          (positions[vertices_[i]] - near).template cast<double>() * scale_;
    if (!vertices_.empty()) samples.colwise() -= fcl::Vector3d(samples.rowwise().mean());
    return samples;
  }

  fcl::Matrix3d axes_ = fcl::Matrix3d::Identity();
  double scale_ = 1;
  std::vector<unsigned> vertices_;
  Samples rest_, last_;  // at the start, and when it looked last
};

}  // namespace adaptive_bvh
