#include "deformable/body_axes.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "mesh/local_bounds.h"

namespace adaptive_bvh {

void BestFitRotation::start(const fcl::Vector3d* positions, const VertexSlots& slots,
                            const fcl::Matrix3d& axes, double scale) {
  axes_ = axes;
  scale_ = scale;
  vertices_ = slots.samples();
  start_ = last_ = samplesOf(positions);
}

/// The samples relative to their centroid, times scale_.
auto BestFitRotation::samplesOf(const fcl::Vector3d* positions) const -> Samples {
  Samples samples(3, vertices_.size());
  if (vertices_.size() == 0) return samples;
  const fcl::Vector3d from = positions[vertices_[0]];
  for (Eigen::Index i = 0; i < vertices_.size(); ++i)
    samples.col(i) = (positions[vertices_[i]] - from) * scale_;
  samples.colwise() -= fcl::Vector3d(samples.rowwise().mean());
  return samples;
}

/// By the algorithm of Kabsch: the singular value decomposition of the covariance of the samples
/// now and at the start.
bool BestFitRotation::update(const fcl::Vector3d* positions, fcl::Matrix3d& axes) {
  constexpr double kMoved = 1. / 1600, kFlat = 1e-4, kRigid = 0.999;  // kMoved: of squares
  constexpr double kCosine = 0.98;                                    // 11 degrees
  const Samples now = samplesOf(positions);
  if (!((now - last_).squaredNorm() > kMoved * start_.squaredNorm())) return false;
  last_ = now;
  const Eigen::JacobiSVD<fcl::Matrix3d> svd(now * start_.transpose(),
                                            Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto& sizes = svd.singularValues();
  if (!(sizes[1] > kFlat * sizes[0])) return false;  // collinear samples determine no rotation
  // By Cauchy and Schwarz, the sum is at most the product of the norms, and equal to it only if the
  // motion is rigid. A body that bends does not rotate as a whole.
  if (!(sizes.sum() > kRigid * now.norm() * start_.norm())) return false;
  fcl::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);  // no reflection
  const fcl::Matrix3d rotated = u * svd.matrixV().transpose() * axes_;
  const double cosine = ((rotated.transpose() * axes).trace() - 1) / 2;
  if (!(cosine < kCosine)) return false;
  axes = rotated;
  return true;
}

namespace {

/// Half the surface area of the body's bounding box along given axes, in coordinates times `scale`.
double boxArea(const std::vector<fcl::Vector3d>& vertices, const fcl::Matrix3d& axes,
               double scale) {
  const fcl::Matrix3d to_axes = scale * axes.transpose();
  const fcl::Vector3d& from = vertices[0];
  fcl::Vector3d low = fcl::Vector3d::Zero(), high = low;
  for (const fcl::Vector3d& v : vertices) {
    const fcl::Vector3d x = to_axes * (v - from);
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const fcl::Vector3d sides = high - low;
  return sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0];
}

/// The inverse of the largest extent of the body; 1 if the extent is tiny.
double scaleOf(const std::vector<fcl::Vector3d>& vertices) {
  const LocalBox<double> box(vertices.data(), vertices.size());
  const double size = (box.high - box.low).maxCoeff();
  return size > 1e-290 ? 1 / size : 1;
}

/// The eigenvectors of the covariance of the vertices, as the columns of a rotation.
fcl::Matrix3d principalAxes(const std::vector<fcl::Vector3d>& vertices, double scale) {
  const fcl::Vector3d& from = vertices[0];
  fcl::Vector3d sum = fcl::Vector3d::Zero();
  fcl::Matrix3d products = fcl::Matrix3d::Zero();
  for (const fcl::Vector3d& v : vertices) {
    const fcl::Vector3d x = scale * (v - from);
    sum += x;
    products += x * x.transpose();
  }
  const auto count = static_cast<double>(vertices.size());
  const fcl::Vector3d mean = sum / count;
  const fcl::Matrix3d covariance = products / count - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<fcl::Matrix3d> solver(covariance);
  fcl::Matrix3d axes = solver.eigenvectors();
  if (solver.info() != Eigen::Success || !axes.allFinite()) return fcl::Matrix3d::Identity();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace

void BodyAxes::start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots) {
  const double scale = scaleOf(vertices);
  constexpr double kSmaller = 0.8;  // ratio of areas at which principal axes are used
  const fcl::Matrix3d principal = principalAxes(vertices, scale), own = fcl::Matrix3d::Identity();
  const bool is_smaller =
      boxArea(vertices, principal, scale) < kSmaller * boxArea(vertices, own, scale);
  start(vertices, slots, is_smaller ? principal : own);
}

void BodyAxes::start(const std::vector<fcl::Vector3d>& vertices, const VertexSlots& slots,
                     const fcl::Matrix3d& axes) {
  axes_ = axes;
  rotation_.start(vertices.data(), slots, axes_, scaleOf(vertices));
}

}  // namespace adaptive_bvh
