// Bounds of bodies that move.
#include "ccd/moving_body.h"

#include <algorithm>
#include <cmath>

#include "base/rounding.h"
#include "ccd/placed_motion.h"

namespace adaptive_bvh {
namespace {

/// Transforms may be off a rotation by 1e-3, so lengths are enlarged by more than that.
constexpr double kTurn = 1.01;

[[noreturn]] void refuseUnusable() { refuseMotion("a position is not finite, or too large"); }

/// Bounds of the positions of vertices at the start and the end.
struct MotionBounds {
  fcl::Vector3d low, high;
  double speed = 0;               ///< the largest displacement
  double deviations[2] = {0, 0};  ///< the largest distances from the mesh's present positions

  /// In the step of a mesh's two-frame update.
  explicit MotionBounds(const MeshState& mesh)
      : speed(mesh.report.largest_displacement), deviations{speed, 0} {
    low = mesh.bounds.aabb_local.min_.array() - speed;
    high = mesh.bounds.aabb_local.max_.array() + speed;
  }
  MotionBounds(const MeshState& mesh, const fcl::Vector3d* start, const fcl::Vector3d* end)
      : low(start[0]), high(start[0]) {
    const auto raise = [](double& most, const fcl::Vector3d& way) {
      most = std::max(most, way.squaredNorm());
    };
    double sum = 0;  // not 0 if a coordinate is not finite
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const fcl::Vector3d &a = start[i], &b = end[i];
      low = low.cwiseMin(a).cwiseMin(b);
      high = high.cwiseMax(a).cwiseMax(b);
      raise(speed, b - a);
      raise(deviations[0], a - mesh.vertices[i]);
      raise(deviations[1], b - mesh.vertices[i]);
      sum += (a + b).sum() * 0;
    }
    for (double* most : {&speed, &deviations[0], &deviations[1]})
      *most = std::sqrt(*most) * (1 + 1e-9) + rounding::tiny<double>();
    if (!(sum == 0)) refuseUnusable();
  }
};

}  // namespace

MovingBody::MovingBody(const MeshState& mesh, const fcl::Vector3d* start, const fcl::Vector3d* end,
                       const FrameMotion& frame)
    : mesh_(&mesh),
      start_(start),
      end_(end),
      frame_(frame),
      from_(frame.at(0)),
      to_(frame.at(1)),
      is_undeformed_(start == mesh.vertices.data() && end == start) {
  const bool is_step = start == mesh.previous.data() && end == mesh.vertices.data();
  const MotionBounds bounds = is_step ? MotionBounds(mesh) : MotionBounds(mesh, start, end);
  const double largest = bounds.low.cwiseAbs().cwiseMax(bounds.high.cwiseAbs()).maxCoeff();
  if (!(largest + frame.reach() <= rounding::largestCoordinate<double>())) refuseUnusable();
  for (std::size_t e = 0; e < 2; ++e) deviations_[e] = bounds.deviations[e] * kTurn;
  setBounds(bounds.low, bounds.high, bounds.speed);
  if (frame_.isScrew()) setAcceleration(bounds.speed);
}

MovingBody::MovingBody(const MeshState& mesh, const FrameMotion& frame)
    : mesh_(&mesh),
      start_(mesh.vertices.data()),
      end_(mesh.vertices.data()),
      frame_(frame),
      from_(frame.at(0)),
      to_(frame.at(1)) {
  const fcl::AABBd& box = mesh.bounds.aabb_local;
  setBounds(box.min_, box.max_, 0);
  if (frame_.isScrew()) setAcceleration(0);
}

MovingBody::MovingBody(const Solid& solid, const FrameMotion& frame, int cell)
    : solid_(&solid), cell_(cell), frame_(frame), from_(frame.at(0)), to_(frame.at(1)) {
  if (const FlatSolid* const plane = flat()) {
    magnitude_ = std::fabs(plane->offset()) + frame_.reach();
    return;
  }
  fcl::Vector3d low, high;
  for (int k = 0; k < 3; ++k) {
    high[k] = solid.support(fcl::Vector3d::Unit(k))[k];
    low[k] = solid.support(-fcl::Vector3d::Unit(k))[k];
  }
  setBounds(low, high, 0);
}

/// Sets the bounds, given the box around all positions in the frame.
void MovingBody::setBounds(const fcl::Vector3d& low, const fcl::Vector3d& high, double speed) {
  middle_ = (low + high) / 2;
  radius_ = (high - low).norm() / 2 * kTurn;
  magnitude_ = kTurn * (middle_.norm() + radius_) + frame_.reach();
  acceleration_ = frame_.acceleration(from_(middle_), radius_, speed * kTurn);
}

/// Sets the acceleration by the distances of all vertices from the axis.
void MovingBody::setAcceleration(double speed) {
  acceleration_ = 0;
  for (std::size_t v = 0; v < mesh_->vertices.size(); ++v)
    for (const fcl::Vector3d* positions : {start_, end_})
      acceleration_ =
          std::max(acceleration_, frame_.acceleration(from_(positions[v]), 0, speed * kTurn));
}

}  // namespace adaptive_bvh
