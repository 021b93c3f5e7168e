#include "motion.h"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace tools {
namespace {

Eigen::AlignedBox3d boxOf(const Positions& points) {
  Eigen::AlignedBox3d box;
  for (const Point& p : points) box.extend(p);
  return box;
}

/// 0 at the ends of the motion, 1 in the middle.
double share(double phase) { return (1 - std::cos(phase)) / 2; }

}  // namespace

Motion::Motion(Positions rest, Style style, Positions target)
    : rest_(std::move(rest)), target_(std::move(target)), style_(style), now_(rest_) {
  const Eigen::AlignedBox3d box = boxOf(rest_);
  center_ = box.center();
  size_ = box.sizes().maxCoeff() / 2;
  box.sizes().minCoeff(&thin_axis_);
}

const Positions& Motion::at(double t) {
  for (std::size_t v = 0; v < rest_.size(); ++v) now_[v] = positionOf(v, 2 * M_PI * t);
  return now_;
}

Point Motion::positionOf(std::size_t v, double phase) const {
  if (style_ == Interpolate) return (1 - share(phase)) * rest_[v] + share(phase) * target_[v];
  const Point q = (rest_[v] - center_) / size_;
  return center_ + size_ * (style_ == Squeeze ? squeezed(q, phase) : waved(q, phase));
}

Point Motion::squeezed(const Point& q, double phase) const {
  const double depth = std::sin(phase);
  const double dent = 0.12 * share(phase) * std::exp(-4 * (q - Point(0.4, 0, 0.5)).squaredNorm());
  return (1 - dent) *
         Point(q[0] * (1 - 0.2 * depth), q[1] * (1 + 0.12 * depth), q[2] * (1 - 0.1 * depth));
}

Point Motion::waved(const Point& q, double phase) const {
  const int along = (thin_axis_ + 1) % 3, across = (thin_axis_ + 2) % 3;
  Point p = q;
  p[thin_axis_] += 0.1 * (std::sin(3 * q[along] + 2 * phase) - std::sin(3 * q[along])) *
                   std::cos(1.5 * q[across]);
  return p;
}

void placeBelow(Positions& plate, const Positions& mesh) {
  const Eigen::AlignedBox3d from = boxOf(plate), above = boxOf(mesh);
  const double scale = above.sizes().maxCoeff() / from.sizes().maxCoeff();
  const Point target(above.center()[0], above.center()[1],
                     above.min()[2] - 0.15 * above.sizes().maxCoeff());
  for (Point& p : plate) p = target + scale * (p - from.center());
}

}  // namespace tools
