#include "mesh/body_axes.h"

#include <algorithm>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace adaptive_bvh {
namespace {

/// About half of the surface of the box around all vertices along some axes.
template <typename S>
double boxArea(const std::vector<fcl::Vector3<S>>& vertices, const fcl::Matrix3d& axes,
               double scale) {
  const fcl::Matrix3d to_axes = scale * axes.transpose();
  const fcl::Vector3d from = vertices[0].template cast<double>();
  fcl::Vector3d low = fcl::Vector3d::Zero(), high = low;
  for (const fcl::Vector3<S>& v : vertices) {
    const fcl::Vector3d x = to_axes * (v.template cast<double>() - from);
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const fcl::Vector3d sides = high - low;
  return sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0];
}

/// 1 / the largest extent of the body, or 1.
template <typename S>
double scaleOf(const std::vector<fcl::Vector3<S>>& vertices) {
  fcl::Vector3<S> low = vertices[0], high = low;
  for (const fcl::Vector3<S>& v : vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const double size = (high.template cast<double>() - low.template cast<double>()).maxCoeff();
  return size > 1e-290 ? 1 / size : 1;
}

template <typename S>
fcl::Matrix3d principalAxes(const std::vector<fcl::Vector3<S>>& vertices, double scale) {
  const fcl::Vector3d from = vertices[0].template cast<double>();
  fcl::Vector3d sum = fcl::Vector3d::Zero();
  fcl::Matrix3d products = fcl::Matrix3d::Zero();
  for (const fcl::Vector3<S>& v : vertices) {
    const fcl::Vector3d x = scale * (v.template cast<double>() - from);
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

/// Of the triangles another corner in turn: the first ones of long slivers may all lie on one line.
template <typename S>
void BodyAxes::start(const std::vector<fcl::Vector3<S>>& vertices, const VertexSlots& slots) {
  scale_ = scaleOf(vertices);
  constexpr double kWorth = 0.8;  // a share of the area
  const fcl::Matrix3d principal = principalAxes(vertices, scale_), own = fcl::Matrix3d::Identity();
  const bool is_worth =
      boxArea(vertices, principal, scale_) < kWorth * boxArea(vertices, own, scale_);
  axes_ = rest_axes_ = is_worth ? principal : own;
  const std::size_t triangles = slots.leaves();  // in the order of the leaves: near ones together
  const std::size_t count = std::min(kSamples, triangles);
  samples_.clear();
  samples_.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    samples_.push_back(slots.verticesOf(i * triangles / count)[i % 3]);
  rest_ = last_ = samplesOf(vertices);
}

template <typename S>
bool BodyAxes::turn(const std::vector<fcl::Vector3<S>>& vertices) {
  return turn(samplesOf(vertices));
}

/// The samples relative to their middle.
template <typename S>
auto BodyAxes::samplesOf(const std::vector<fcl::Vector3<S>>& vertices) const -> Samples {
  Samples samples(3, static_cast<Eigen::Index>(samples_.size()));
  const fcl::Vector3d from = vertices[samples_[0]].template cast<double>();
  for (std::size_t i = 0; i < samples_.size(); ++i)
    samples.col(static_cast<Eigen::Index>(i)) =
        (vertices[samples_[i]].template cast<double>() - from) * scale_;
  samples.colwise() -= fcl::Vector3d(samples.rowwise().mean());
  return samples;
}

bool BodyAxes::turn(const Samples& now) {
  constexpr double kMoved = 1. / 1600, kFlat = 1e-4, kRigid = 0.999;
  constexpr double kCosine = 0.98;  // 11 degrees
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
  const fcl::Matrix3d turned = u * svd.matrixV().transpose() * rest_axes_;
  const double cosine = ((turned.transpose() * axes_).trace() - 1) / 2;
  if (!(cosine < kCosine)) return false;
  axes_ = turned;
  return true;
}

template void BodyAxes::start(const std::vector<fcl::Vector3<float>>&, const VertexSlots&);
template void BodyAxes::start(const std::vector<fcl::Vector3<double>>&, const VertexSlots&);
template bool BodyAxes::turn(const std::vector<fcl::Vector3<float>>&);
template bool BodyAxes::turn(const std::vector<fcl::Vector3<double>>&);

}  // namespace adaptive_bvh
