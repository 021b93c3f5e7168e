#pragma once

#include "surface.h"

namespace harness {

/// Material of a bundle of wires, each stiffness by mass and length, so that rods of any radius
/// have the same.
struct RodMaterial {
  double stretching_speed = 50e3;  ///< of waves along a rod, mm/s; lower than that of copper
  double bending = 220e3;          ///< sqrt(bending stiffness / mass per length), mm^2/s
  double twisting = 180e3;         ///< sqrt(twisting stiffness / mass per length), mm^2/s
};

/// Elastic rods that branch: nodes joined by straight edges, each with a material frame whose z
/// axis lies along the edge. Springs hold the length of an edge, its frame along it (stretching and
/// shear), and the rotation from the frame of its parent edge to its own (bending and twisting;
/// discrete Cosserat rods, after Lang, Linn and Arnold, Multibody System Dynamics 25, 2011). A rod
/// rests as it was built. Lengths are in millimetres, the density is 1.
class ElasticRods {
 public:
  explicit ElasticRods(const RodMaterial& material) : material_(material) {}

  std::size_t addNode(const Point& position);
  /// An edge between two nodes, with a frame along it. `parent` is an edge before it that ends
  /// where it begins, or -1. Returns its number.
  int addEdge(std::size_t from, std::size_t to, int parent, double radius,
              const Eigen::Quaterniond& frame);
  /// Both nodes of the edge and its frame stay where they are.
  void clamp(int edge);

  /// Semi-implicit Euler: velocities from forces, positions from velocities. `gravity` acts on all
  /// nodes; velocities decay by `damping`, 1/s.
  void step(double seconds, const Point& gravity, double damping);

  const Points& positions() const { return positions_; }
  const Eigen::Quaterniond& frame(int edge) const { return edges_[std::size_t(edge)].frame; }
  /// The largest change of an edge's length, relative.
  double largestStrain() const;

 private:
  struct Edge {
    std::size_t from, to;
    int parent;
    double length, area, inertia;
    Eigen::Quaterniond frame;
    Eigen::Quaterniond from_parent;  ///< this frame in the parent's, at rest
    Point spin = Point::Zero(), torque = Point::Zero();
    bool clamped = false;
  };
  void addStretching(Edge& edge);
  void addBending(Edge& edge);
  void moveNodes(double seconds, const Point& gravity, double decay);
  void turnFrames(double seconds, double decay);

  RodMaterial material_;
  Points positions_, velocities_, forces_;
  std::vector<double> masses_;
  std::vector<bool> clamped_;
  std::vector<Edge> edges_;
};

}  // namespace harness
