#include "harness.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solids.h"

namespace harness {
namespace {

constexpr double kEdge = 10;                     // length of an edge, mm
constexpr double kSubstep = 5e-5;                // stable up to 1.3e-4 s
constexpr double kSettling = 60, kDamping = 10;  // 1/s
const Point kGravity(0, 0, -9810);

/// The shaker's acceleration, mm/s^2: a sine of 12 m/s^2 up and down and less sideways, which
/// rises from 5 to 16 Hz within 2.5 s.
Point shakerAcceleration(double t) {
  const double swept = std::min(t, 2.5);
  const double phase = 2 * M_PI * (5 * t + 11 / 2.5 * (swept * t - swept * swept / 2));
  const double fade_in = std::min(1., t / 0.05);
  return 12e3 * fade_in *
         Point(0.4 * std::sin(phase + 2), 0.7 * std::sin(phase + 1), std::sin(phase));
}

std::size_t nearest(const Points& points, const Point& p) {
  const auto is_nearer = [&](const Point& a, const Point& b) {
    return (a - p).squaredNorm() < (b - p).squaredNorm();
  };
  return std::size_t(std::min_element(points.begin(), points.end(), is_nearer) - points.begin());
}

/// A frame along each edge of a curve, turned as little as possible from one to the next.
std::vector<Eigen::Quaterniond> framesAlong(const Points& curve, const Point& normal) {
  Points directions;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i)
    directions.emplace_back((curve[i + 1] - curve[i]).normalized());
  const Points normals = transportedNormals(directions, normal);
  std::vector<Eigen::Quaterniond> frames;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    Eigen::Matrix3d axes;
    axes << normals[i], directions[i].cross(normals[i]), directions[i];
    frames.emplace_back(axes);
  }
  return frames;
}

}  // namespace

Harness::Harness(std::size_t triangles) : rods_(RodMaterial()) {
  if (triangles < 4000)
    throw std::invalid_argument("a harness has at least 4000 triangles, not " +
                                std::to_string(triangles));
  for (const Cable& cable : cables()) addCable(cable);
  for (const Rod& rod : cables_) clampEnds(rod);
  for (double t = 0; t < 0.8; t += kSubstep) rods_.step(kSubstep, kGravity, kSettling);
  tessellate(triangles);
  surface_ = currentSurface();
}

void Harness::addCable(const Cable& cable) {
  Rod rod{cable, {}, {}, {}, 0, 0};
  Points curve = smoothCurve(cable.route, kEdge);
  Point normal = Point::UnitX();
  int parent = -1;
  if (cables_.empty()) {
    rod.nodes.push_back(rods_.addNode(curve[0]));
  } else {
    Rod& trunk = cables_[0];
    Points axis;
    for (const std::size_t node : trunk.nodes) axis.push_back(rods_.positions()[node]);
    const std::size_t at = nearest(axis, curve[0]);
    curve[0] = axis[at];
    parent = trunk.edges[at - 1];
    normal = rods_.frame(parent) * Point::UnitX();
    rod.nodes.push_back(trunk.nodes[at]);
    trunk.sleeves.push_back({double(at), 2.2, 2.2});
  }
  const std::vector<Eigen::Quaterniond> frames = framesAlong(curve, normal);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    rod.nodes.push_back(rods_.addNode(curve[i + 1]));
    parent = rods_.addEdge(rod.nodes[i], rod.nodes[i + 1], parent, cable.radius, frames[i]);
    rod.edges.push_back(parent);
  }
  for (const Point& clip : cable.clips) {
    const std::size_t at = std::max<std::size_t>(1, nearest(curve, clip));
    rods_.clamp(rod.edges[at - 1]);
    rods_.clamp(rod.edges[at]);
    rod.sleeves.push_back({double(at), 0.7, 1.2});
  }
  cables_.push_back(std::move(rod));
}

void Harness::clampEnds(const Rod& rod) {
  // The trunk ends where its last branches begin.
  rods_.clamp(&rod == &cables_[0] ? rod.edges.front() : rod.edges.back());
}

void Harness::advance() {
  const int substeps = int(std::lround(1 / (kFramesPerSecond * kSubstep)));
  for (int i = 0; i < substeps; ++i) {
    rods_.step(kSubstep, kGravity - shakerAcceleration(time_), kDamping);
    time_ += kSubstep;
  }
  surface_ = currentSurface();
}

}  // namespace harness
