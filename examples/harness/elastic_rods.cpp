#include "elastic_rods.h"

#include <algorithm>
#include <cmath>

namespace harness {

std::size_t ElasticRods::addNode(const Point& position) {
  positions_.push_back(position);
  velocities_.emplace_back(Point::Zero());
  forces_.emplace_back(Point::Zero());
  masses_.push_back(0);
  clamped_.push_back(false);
  return positions_.size() - 1;
}

int ElasticRods::addEdge(std::size_t from, std::size_t to, int parent, double radius,
                         const Eigen::Quaterniond& frame) {
  Edge edge{from,
            to,
            parent,
            (positions_[to] - positions_[from]).norm(),
            M_PI * radius * radius,
            0,
            frame,
            Eigen::Quaterniond::Identity()};
  const double mass = edge.area * edge.length;
  masses_[from] += mass / 2;
  masses_[to] += mass / 2;
  // One moment for all axes, larger than that of a cylinder: frames follow slowly enough for the
  // step, and still far faster than the rods swing.
  edge.inertia = mass * (radius * radius + edge.length * edge.length) / 4;
  if (parent >= 0) edge.from_parent = edges_[std::size_t(parent)].frame.conjugate() * frame;
  edges_.push_back(edge);
  return static_cast<int>(edges_.size()) - 1;
}

void ElasticRods::clamp(int edge) {
  Edge& held = edges_[std::size_t(edge)];
  held.clamped = clamped_[held.from] = clamped_[held.to] = true;
}

void ElasticRods::addStretching(Edge& edge) {
  const Point along = edge.frame * Point::UnitZ();
  const Point slope = (positions_[edge.to] - positions_[edge.from]) / edge.length;
  const double stiffness = edge.area * material_.stretching_speed * material_.stretching_speed;
  const Point force = stiffness * (slope - along);
  forces_[edge.from] += force;
  forces_[edge.to] -= force;
  edge.torque += stiffness * edge.length * along.cross(slope);
}

void ElasticRods::addBending(Edge& edge) {
  Edge& parent = edges_[std::size_t(edge.parent)];
  const Eigen::Quaterniond turn = edge.frame * (parent.frame * edge.from_parent).conjugate();
  const Point rotation = (turn.w() < 0 ? -2 : 2) * turn.vec();
  const Point along = edge.frame * Point::UnitZ();
  const Point twist = along.dot(rotation) * along;
  const double area = std::min(edge.area, parent.area);
  const double length = (edge.length + parent.length) / 2;
  const Point moment = area / length *
                       (material_.bending * material_.bending * (rotation - twist) +
                        material_.twisting * material_.twisting * twist);
  edge.torque -= moment;
  parent.torque += moment;
}

void ElasticRods::moveNodes(double seconds, const Point& gravity, double decay) {
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (!clamped_[i]) {
      velocities_[i] = decay * (velocities_[i] + seconds * (forces_[i] / masses_[i] + gravity));
      positions_[i] += seconds * velocities_[i];
    }
    forces_[i].setZero();
  }
}

void ElasticRods::turnFrames(double seconds, double decay) {
  for (Edge& edge : edges_) {
    if (!edge.clamped) {
      edge.spin = decay * (edge.spin + seconds / edge.inertia * edge.torque);
      const Point half = seconds / 2 * edge.spin;
      edge.frame = (Eigen::Quaterniond(1, half[0], half[1], half[2]) * edge.frame).normalized();
    }
    edge.torque.setZero();
  }
}

void ElasticRods::step(double seconds, const Point& gravity, double damping) {
  for (Edge& edge : edges_) {
    addStretching(edge);
    if (edge.parent >= 0) addBending(edge);
  }
  const double decay = std::exp(-damping * seconds);
  moveNodes(seconds, gravity, decay);
  turnFrames(seconds, decay);
}

double ElasticRods::largestStrain() const {
  double largest = 0;
  for (const Edge& edge : edges_) {
    const double length = (positions_[edge.to] - positions_[edge.from]).norm();
    largest = std::max(largest, std::abs(length / edge.length - 1));
  }
  return largest;
}

}  // namespace harness
