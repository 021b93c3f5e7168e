#pragma once

#include <functional>
#include <vector>

#include <fcl/common/types.h>
#include <fcl/math/triangle.h>

#include "support/quad_geometry.h"

namespace adaptive_bvh_test {

/// The judge of distances over a motion: positions at any time and distances of triangles in
/// quadruple precision, and bisection of the motion by the largest speeds. It shares no code with
/// the library.
namespace quad {

struct Matrix {
  Point rows[3];
};
inline Point operator*(const Matrix& m, const Point& x) {
  return {dot(m.rows[0], x), dot(m.rows[1], x), dot(m.rows[2], x)};
}
inline Real entry(const Point& p, int k) { return k == 0 ? p.x : k == 1 ? p.y : p.z; }
inline Matrix transposed(const Matrix& m) {
  Matrix t;
  for (int i = 0; i < 3; ++i)
    t.rows[i] = {entry(m.rows[0], i), entry(m.rows[1], i), entry(m.rows[2], i)};
  return t;
}
inline Matrix product(const Matrix& a, const Matrix& b) {
  const Matrix columns = transposed(b);
  Matrix m;
  for (int i = 0; i < 3; ++i)
    m.rows[i] = {dot(a.rows[i], columns.rows[0]), dot(a.rows[i], columns.rows[1]),
                 dot(a.rows[i], columns.rows[2])};
  return m;
}

/// By their power series.
inline void sineAndCosine(Real x, Real& sine, Real& cosine) {
  Real term = 1;
  sine = 0, cosine = 0;
  for (int k = 0; k < 60; ++k) {
    (k % 2 ? sine : cosine) += (k / 2) % 2 ? -term : term;
    term = term * x / Real(k + 1);
  }
}

/// A frame that goes from one transform to another: each point on a straight line, or on a screw.
class FramePair {
 public:
  FramePair(const fcl::Transform3d& from, const fcl::Transform3d& to, bool is_screw)
      : from_(matrixOf(from)), to_(matrixOf(to)), screw_(is_screw) {
    from_t_ = of(from.translation());
    to_t_ = of(to.translation());
    if (screw_) setScrew();
  }

  /// Where the point x of the frame at the start, and y at the end, is at time t.
  Point operator()(Real t, const Point& x, const Point& y) const {
    if (!screw_) return (1 - t) * (from_ * x + from_t_) + t * (to_ * y + to_t_);
    const Point start = from_ * ((1 - t) * x + t * y);
    // Rodrigues: about the axis through the frame's origin.
    Real sine, cosine;
    sineAndCosine(t * angle_, sine, cosine);
    const Point turned =
        cosine * start + sine * cross(axis_, start) + (1 - cosine) * dot(axis_, start) * axis_;
    // The origin turns about the axis of the screw through `center_`.
    const Point arm = from_t_ - center_;
    const Point origin = center_ + cosine * arm + sine * cross(axis_, arm) +
                         (1 - cosine) * dot(axis_, arm) * axis_ + t * advance_ * axis_;
    return turned + origin;
  }

 private:
  static Matrix matrixOf(const fcl::Transform3d& tf) {
    Matrix m;
    for (int i = 0; i < 3; ++i)
      m.rows[i] = {Real(tf.linear()(i, 0)), Real(tf.linear()(i, 1)), Real(tf.linear()(i, 2))};
    return m;
  }
  /// The axis from the antisymmetric part of the rotation, or near half a turn from its symmetric
  /// part.
  void setScrew() {
    const Matrix r = product(to_, transposed(from_));
    const Point twice = {r.rows[2].y - r.rows[1].z, r.rows[0].z - r.rows[2].x,
                         r.rows[1].x - r.rows[0].y};
    const Real trace = r.rows[0].x + r.rows[1].y + r.rows[2].z, length = root(dot(twice, twice));
    const Real sine = length / 2, cosine = (trace - 1) / 2;
    angle_ = Real(std::atan2(static_cast<double>(sine), static_cast<double>(cosine)));
    for (int i = 0; i < 4; ++i) {
      Real s, c;
      sineAndCosine(angle_, s, c);
      angle_ += sine * c - cosine * s;
    }
    axis_ = length > 0 ? (1 / length) * twice : Point{1, 0, 0};
    if (sine < Real(1e-3) && cosine < 0) axis_ = axisOfHalfTurn(r, twice);
    const Point moved = to_t_ - from_t_;
    advance_ = dot(axis_, moved);
    const Point across = moved - advance_ * axis_;
    Real s, c;
    sineAndCosine(angle_ / 2, s, c);
    center_ = from_t_;
    if (s > Real(1e-25))  // less is rounding of equal rotations
      center_ = from_t_ + Real(0.5) * across + (c / (2 * s)) * cross(axis_, across);
    else
      screw_ = false;  // no turn
  }
  static Point axisOfHalfTurn(const Matrix& r, const Point& twice) {
    int best = 0;
    for (int k = 1; k < 3; ++k)
      if (entry(r.rows[k], k) > entry(r.rows[best], best)) best = k;
    Point axis = {entry(r.rows[best], 0) + entry(r.rows[0], best),
                  entry(r.rows[best], 1) + entry(r.rows[1], best),
                  entry(r.rows[best], 2) + entry(r.rows[2], best)};
    (best == 0   ? axis.x
     : best == 1 ? axis.y
                 : axis.z) += 1 - (r.rows[0].x + r.rows[1].y + r.rows[2].z);
    axis = (1 / root(dot(axis, axis))) * axis;
    return dot(axis, twice) < 0 ? Real(-1) * axis : axis;
  }

  Matrix from_, to_;
  Point from_t_, to_t_, axis_ = {1, 0, 0}, center_ = {0, 0, 0};
  bool screw_;
  Real angle_ = 0, advance_ = 0;
};

/// A moving mesh.
struct MovingTriangles {
  std::vector<fcl::Vector3d> start, end;
  std::vector<fcl::Triangle> triangles;
  FramePair frame;

  Point vertex(std::size_t v, Real t) const { return frame(t, of(start[v]), of(end[v])); }
  Triangle triangle(std::size_t i, Real t) const {
    return {vertex(triangles[i][0], t), vertex(triangles[i][1], t), vertex(triangles[i][2], t)};
  }
};

/// The least value of a function of time with a largest slope, between bounds.
struct Least {
  Real lower, upper, time;
};

/// Bisection: `distance` changes by at most `speed` in a unit of time. Ends after `most` values.
inline Least leastOf(const std::function<Real(Real)>& distance, Real speed, Real tolerance,
                     int most) {
  struct Part {
    Real begin, end, at_begin, at_end;
    Real lower(Real slope) const { return (at_begin + at_end - slope * (end - begin)) / 2; }
  };
  std::vector<Part> open;
  Least least = {0, distance(0), 0};
  const auto value = [&](Real t) {
    const Real d = distance(t);
    if (d < least.upper) least.upper = d, least.time = t;
    return d;
  };
  const int first = 8;
  Real before = least.upper;
  for (int i = 1; i <= first; ++i) {
    const Real now = value(Real(i) / first);
    open.push_back({Real(i - 1) / first, Real(i) / first, before, now});
    before = now;
  }
  for (int count = 0; count < most; ++count) {
    const auto lowest = std::min_element(
        open.begin(), open.end(),
        [&](const Part& a, const Part& b) { return a.lower(speed) < b.lower(speed); });
    least.lower = lowest->lower(speed);
    if (least.lower >= least.upper - tolerance) break;
    const Part part = *lowest;
    const Real middle = (part.begin + part.end) / 2, now = value(middle);
    *lowest = {part.begin, middle, part.at_begin, now};
    open.push_back({middle, part.end, now, part.at_end});
  }
  return least;
}

}  // namespace quad
}  // namespace adaptive_bvh_test
