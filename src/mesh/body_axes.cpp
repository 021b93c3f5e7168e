#include "mesh/body_axes.h"

#include <Eigen/Eigenvalues>

#include "mesh/box_after_some.h"

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
  const LocalBox<S> box(vertices.data(), vertices.size());
  const double size =
      (box.high.template cast<double>() - box.low.template cast<double>()).maxCoeff();
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

template <typename S>
void BodyAxes::start(const std::vector<fcl::Vector3<S>>& vertices, const VertexSlots& slots) {
  const double scale = scaleOf(vertices);
  constexpr double kWorth = 0.8;  // a share of the area
  const fcl::Matrix3d principal = principalAxes(vertices, scale), own = fcl::Matrix3d::Identity();
  const bool is_worth =
      boxArea(vertices, principal, scale) < kWorth * boxArea(vertices, own, scale);
  axes_ = is_worth ? principal : own;
  turn_.start(vertices.data(), slots, axes_, scale);
}

template void BodyAxes::start(const std::vector<fcl::Vector3<float>>&, const VertexSlots&);
template void BodyAxes::start(const std::vector<fcl::Vector3<double>>&, const VertexSlots&);

}  // namespace adaptive_bvh
