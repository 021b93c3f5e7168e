#include "scenarios.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "bodies.h"

namespace scenarios {
namespace {

constexpr double kSide = 2.7;  // of plates and sheets

/// 0 to 1 with rest at both ends.
double smooth(double t) { return t * t * (3 - 2 * t); }

/// A circular arc of curvature k that leaves the origin along +x, after the length s: the point,
/// and how far the direction has turned.
struct Arc {
  double x, y, turn;
};
Arc arcAt(double k, double s) {
  const double a = k * s, half = a / 2;
  const double chord = std::abs(half) < 1e-8 ? s : s * std::sin(half) / half;
  return {chord * std::cos(half), chord * std::sin(half), a};
}

Point bulge(const Point& p, double t) {
  const double profile = std::cos(M_PI * p[0] / kSide) * std::cos(M_PI * p[1] / kSide);
  return p + Point(0, 0, 0.35 * std::sin(2 * M_PI * t) * profile);
}

Point twist(const Point& p, double t) {
  const double angle = 2 * M_PI * smooth(t) * p[0] / kSide;
  return {p[0], p[1] * std::cos(angle), p[1] * std::sin(angle)};
}

/// The middle line is an arc in a plane through z that turns slowly; cross sections stay circles.
Point swing(const Point& p, double t) {
  const double plane = 0.6 * std::sin(2 * M_PI * t);
  const Arc arc = arcAt(0.55 * std::sin(4 * M_PI * t), -p[2]);
  const double across = p[0] * std::cos(plane) + p[1] * std::sin(plane);
  const double beside = -p[0] * std::sin(plane) + p[1] * std::cos(plane);
  const double out = arc.y + across * std::cos(arc.turn);
  const double down = arc.x - across * std::sin(arc.turn);
  return {out * std::cos(plane) - beside * std::sin(plane),
          out * std::sin(plane) + beside * std::cos(plane), -down};
}

Point squeeze(const Point& p, double t) {
  const double depth = std::sin(M_PI * t);
  const double dent = 0.25 * depth * std::exp(-4 * (p - Point(0.4, 0, 0.9)).squaredNorm());
  return (1 - dent) *
         Point(p[0] * (1 - 0.2 * depth), p[1] * (1 + 0.15 * depth), p[2] * (1 - 0.1 * depth));
}

/// A band in the middle bends to an arc, both halves stay flat and turn up until they face.
Point fold(const Point& p, double t) {
  constexpr double kBand = 0.5;
  const double side = p[0] < 0 ? -1 : 1, s = std::abs(p[0]);
  const Arc arc = arcAt(0.93 * M_PI * smooth(t) / kBand, std::min(s, kBand / 2));
  const double flat = std::max(0., s - kBand / 2);
  return {side * (arc.x + flat * std::cos(arc.turn)), p[1], arc.y + flat * std::sin(arc.turn)};
}

Point still(const Point& p, double) { return p; }

/// A dent of radius 0.15 in the middle, down to 0.3 and back: pi 0.15^2 of 2.7^2 is 1 %.
constexpr double kDentRadius = 0.153;
double dentDepth(double t) { return 0.3 * std::sin(M_PI * t); }
Point poke(const Point& p, double t) {
  const double r = std::hypot(p[0], p[1]) / kDentRadius;
  return r < 1 ? p - Point(0, 0, dentDepth(t) * std::pow(1 - r * r, 2)) : p;
}

/// A small dome upside down that follows the bottom of the dent at a short distance.
Point pokingTool(const Point& p, double t) {
  return {0.05 * p[0], -0.05 * p[1], 0.05 * (1.1 - p[2]) + 0.12 - dentDepth(t)};
}

/// Falls freely from above the helmet, and stops where it arrives; outside it hangs down, as far as
/// its middle has fallen. The edge between both is rounded.
Point drape(const Point& p, double t) {
  const double falling = 2.2 - 3 * t * t;
  const double r2 = std::pow(p[0] / 0.99, 2) + std::pow(p[1] / 1.16, 2);
  const double resting = 0.02 + (r2 < 1 ? 1.1 * std::sqrt(1 - r2) : -0.5 * (std::sqrt(r2) - 1));
  const double gap = falling - resting;
  const double z = resting + (gap + std::sqrt(gap * gap + 4e-4)) / 2;  // a smooth maximum with 0
  return {p[0], p[1], z};
}

Point vibrate(const Point& p, double t) {
  const double phase = 2 * M_PI * 15 * t;  // 60 frames: four a period
  return p * (1 + 0.01 * std::sin(phase) * std::sin(9 * p[0] + 4 * p[1]) * std::cos(7 * p[2]));
}

Point tumble(const Point& p, double t) {
  const Point axis = Point(0.7, 0.6, 0.2).normalized();
  return Eigen::AngleAxisd(4 * M_PI * smooth(t), axis) * p;
}

Pose turned(double degrees, const Point& axis) {
  return Pose(Eigen::AngleAxisd(degrees * M_PI / 180, axis.normalized()));
}
Pose moved(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

std::vector<Scenario> oriented(std::vector<Scenario> scenarios, const Options& options) {
  if (!options.aligned)
    for (Scenario& scenario : scenarios) scenario = turnedGenerically(scenario);
  return scenarios;
}

}  // namespace

Body::Body(std::string name, Mesh rest, int frames, Motion motion)
    : name_(std::move(name)), rest_(std::move(rest)), frames_(frames), motion_(std::move(motion)) {}

Body::Body(std::string name, Mesh rest, int frames, PointMotion motion)
    : Body(std::move(name), std::move(rest), frames,
           [motion](const std::vector<Point>& points, double t, std::vector<Point>& out) {
             for (std::size_t v = 0; v < points.size(); ++v) out[v] = motion(points[v], t);
           }) {}

Mesh Body::mesh() const {
  Mesh mesh;
  mesh.triangles = rest_.triangles;
  mesh.vertices = positions(0);
  return mesh;
}

void Body::positions(int frame, std::vector<Point>& out) const {
  const double t = std::min(1., double(frame) * stride_ / frames_);
  out.resize(rest_.vertices.size());
  motion_(rest_.vertices, t, out);
  for (Point& p : out) p = pose_ * p;
}

std::vector<Point> Body::positions(int frame) const {
  std::vector<Point> out;
  positions(frame, out);
  return out;
}

Body Body::placed(const Pose& pose) const {
  Body body = *this;
  body.pose_ = pose * pose_;
  return body;
}

Body Body::withStride(int stride) const {
  Body body = *this;
  body.stride_ = stride * stride_;
  return body;
}

Body plate(int resolution) {
  return {"plate", grid(9 * resolution, 9 * resolution, kSide, kSide), 62, bulge};
}
Body twistingPlate(int resolution) {
  return {"twisting plate", grid(9 * resolution, 9 * resolution, kSide, kSide), 218, twist};
}
Body cable(int resolution) {
  return {"cable", tube(10 * resolution, 9 * resolution, 0.2, 2.7), 127, swing};
}
Body helmet(int resolution) { return {"helmet", dome(resolution), 20, squeeze}; }
Body foldingSheet(int resolution) {
  return {"folding sheet", grid(9 * resolution, 9 * resolution, kSide, kSide), 29, fold};
}

std::vector<Scenario> thesisScenarios(const Options& options) {
  const int s = options.resolution;
  const Point y = Point::UnitY(), x = Point::UnitX();
  std::vector<Scenario> all;
  all.push_back({"plate and twisting plate", plate(s), twistingPlate(s).placed(moved(0, 0, 1.37))});
  all.push_back(
      {"cable and plate", cable(s), plate(s).placed(moved(1.6, 0, -1.35) * turned(90, y))});
  all.push_back({"helmet and folding sheet", helmet(s),
                 foldingSheet(s).placed(moved(0, 0, 2.25) * turned(180, x))});
  all.push_back({"helmet and cable", helmet(s), cable(s).placed(moved(0, 1.485, 1.6))});
  all.push_back({"helmet and plate", helmet(s), plate(s).placed(moved(0, 0, -0.39))});
  return oriented(std::move(all), options);
}

std::vector<Scenario> furtherScenarios(const Options& options) {
  const int s = options.resolution;
  std::vector<Scenario> all;
  all.push_back({"local poke",
                 {"sheet", grid(36 * s, 36 * s, kSide, kSide), 60, poke},
                 Body("tool", dome(s), 60, pokingTool)});
  all.push_back({"cloth drop",
                 {"cloth", grid(70 * s, 70 * s, kSide, kSide), 40, drape},
                 {"dome", dome(2 * s), 1, still}});
  all.push_back(
      {"vibration",
       {"helmet", dome(2 * s), 60, vibrate},
       Body("plate", grid(18 * s, 18 * s, kSide, kSide), 1, still).placed(moved(0, 0, -0.3))});
  all.push_back(
      {"rigid tumble",
       {"helmet", dome(2 * s), 60, tumble},
       Body("plate", grid(18 * s, 18 * s, kSide, kSide), 1, still).placed(moved(0, 0, -1.17))});
  return oriented(std::move(all), options);
}

Scenario turnedGenerically(const Scenario& scenario) {
  const Pose generic = turned(67.3, {0.48, -0.31, 0.82});
  return {scenario.name, scenario.first.placed(generic), scenario.second.placed(generic)};
}

Scenario withStride(const Scenario& scenario, int stride) {
  return {scenario.name, scenario.first.withStride(stride), scenario.second.withStride(stride)};
}

MotionSize measureMotion(const Body& body) {
  const Mesh rest = body.mesh();
  double edges = 0;
  for (const fcl::Triangle& t : rest.triangles)
    for (int k = 0; k < 3; ++k)
      edges += (rest.vertices[t[k]] - rest.vertices[t[(k + 1) % 3]]).norm();
  const double edge = edges / (3. * double(rest.triangles.size()));
  Eigen::AlignedBox3d box;
  for (const Point& p : rest.vertices) box.extend(p);
  const double diagonal = box.diagonal().norm();

  double sum = 0, largest = 0;
  std::vector<Point> before = rest.vertices, now;
  for (int frame = 1; frame <= body.frames(); ++frame, before.swap(now)) {
    body.positions(frame, now);
    for (std::size_t v = 0; v < now.size(); ++v) {
      const double step = (now[v] - before[v]).norm();
      sum += step;
      largest = std::max(largest, step);
    }
  }
  const double mean = sum / (double(body.vertices()) * body.frames());
  return {mean / edge, largest / edge, mean / diagonal, largest / diagonal};
}

}  // namespace scenarios
