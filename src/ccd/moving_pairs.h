#pragma once

#include <algorithm>
#include <array>

#include "ccd/moving_body.h"
#include "triangles/triangle_gap.h"

// Pairs of parts of two moving bodies: triangles, shapes, planes. Each type has
//
//   At at(t)                the parts at a time
//   gap(at)                 their nearest points then
//   separation(at, n)       how far they are apart along a unit vector n, from the first to the
//                           second; may be negative
//   slack(a, b)             for times t between those of a and b: the distance is at least the
//   linear
//                           interpolation of the separations at a and b along any n, less this
//   farthest(a, b, s, e)    an upper bound of the distance between the times of a and b: of points
//                           that go evenly, in their parts, from the nearest ones of the sample s
//                           to those of e
//   gapError(distance)      bound of the error of a distance at a time
//   kGuesses, guess(at, i)  directions that may separate the parts; a zero vector is none
//   manyGuesses(at, n)      more of them, for parts so near that the direction n between their
//                           nearest points has lost its digits
//
// docs/bounds.md, 22.
namespace adaptive_bvh {

/// The bodies of a pair, and the numbers of their parts: leaf indices of triangles.
struct PartNumbers {
  unsigned first, second;
};

/// The direction from the first of two nearest points to the second; zero if the parts touch.
inline fcl::Vector3d directionOf(const TriangleGap& gap) {
  if (!(gap.distance > 0)) return fcl::Vector3d::Zero();
  const fcl::Vector3d between = gap.points.second - gap.points.first;
  const double length = between.stableNorm();
  return length > 0 ? fcl::Vector3d(between / length) : fcl::Vector3d(fcl::Vector3d::Zero());
}

/// The nearest points of a pair at one time.
template <typename Pair>
struct PairSample {
  typename Pair::At at;
  TriangleGap gap;
  fcl::Vector3d normal;  ///< unit vector between the points, or zero

  PairSample(const Pair& pair, const typename Pair::At& now)
      : at(now), gap(pair.gap(now)), normal(directionOf(gap)) {}
};

/// Errors and arcs of a pair of bodies.
class PairSlack {
 public:
  PairSlack(const MovingBody& first, const MovingBody& second)
      : acceleration_(first.acceleration() + second.acceleration()),
        rounding_(2 * (first.error() + second.error())),
        size_(first.radius() + second.radius()) {}

  /// Within a time `length` long, for a separation.
  double operator()(double length) const { return acceleration_ * length * length / 8 + rounding_; }
  /// For a distance. `share`: its error relative to the extent of the parts.
  double ofGap(double distance, double share) const {
    return rounding_ + share * (size_ + distance);
  }

 private:
  double acceleration_, rounding_, size_;
};

/// What all pairs have: the bodies, the numbers of the parts, and their slack.
class PairOfParts {
 public:
  PairOfParts(const MovingBody& first, const MovingBody& second, const PartNumbers& parts)
      : first_(first), second_(second), parts_(parts), slack_(first, second) {}

  template <typename At>
  double slack(const At& a, const At& b) const {
    return slack_(b.t - a.t);
  }

 protected:
  const MovingBody &first_, &second_;
  const PartNumbers parts_;
  const PairSlack slack_;
};

/// Two triangles.
class MovingTrianglePair : public PairOfParts {
 public:
  struct At {
    double t;
    TrianglePoints a, b;
  };

  using PairOfParts::PairOfParts;
  using Sample = PairSample<MovingTrianglePair>;

  At at(double t) const {
    return {t, first_.triangle(parts_.first, first_.at(t)),
            second_.triangle(parts_.second, second_.at(t))};
  }
  static TriangleGap gap(const At& at) { return gapOf(at.a, at.b); }
  static double separation(const At& at, const fcl::Vector3d& n) {
    const fcl::Vector3d& origin = at.a[0];
    return std::min({n.dot(at.b[0] - origin), n.dot(at.b[1] - origin), n.dot(at.b[2] - origin)}) -
           std::max({0., n.dot(at.a[1] - origin), n.dot(at.a[2] - origin)});
  }
  /// The direction between the middles of both, and both normals.
  static constexpr int kGuesses = 3;
  static fcl::Vector3d guess(const At& at, int i);
  /// Both normals, what is perpendicular to an edge of each, and n made perpendicular to an edge.
  static std::array<fcl::Vector3d, 17> manyGuesses(const At& at, const fcl::Vector3d& n);
  double farthest(const At& a, const At& b, const Sample& from, const Sample& to) const;
  double gapError(double distance) const { return slack_.ofGap(distance, 0x1p-44); }
};

/// A triangle or a shape, and a shape; both bounded.
class SolidPair : public PairOfParts {
 public:
  struct At {
    double t;
    MovingBody::At a, b;
    TrianglePoints triangle;  ///< if the first is a triangle
  };

  using PairOfParts::PairOfParts;
  using Sample = PairSample<SolidPair>;

  At at(double t) const;
  TriangleGap gap(const At& at) const;
  double separation(const At& at, const fcl::Vector3d& n) const;
  static constexpr int kGuesses = 1;
  fcl::Vector3d guess(const At& at, int) const;
  std::array<fcl::Vector3d, 1> manyGuesses(const At& at, const fcl::Vector3d&) const {
    return {guess(at, 0)};
  }
  double farthest(const At& a, const At& b, const Sample& from, const Sample& to) const;
  double gapError(double distance) const { return slack_.ofGap(distance, 0x1p-40); }
};

/// A triangle or a bounded shape, and a plane or half-space.
class FlatPair : public PairOfParts {
 public:
  struct At {
    double t;
    MovingBody::At a;
    TrianglePoints triangle;
    fcl::Vector3d normal;  ///< of the plane normal * x = offset, not always of length 1
    double offset;
  };

  using PairOfParts::PairOfParts;
  using Sample = PairSample<FlatPair>;

  At at(double t) const;
  TriangleGap gap(const At& at) const;
  double separation(const At& at, const fcl::Vector3d& n) const;
  static constexpr int kGuesses = 1;
  static fcl::Vector3d guess(const At& at, int) { return -at.normal.stableNormalized(); }
  static std::array<fcl::Vector3d, 1> manyGuesses(const At& at, const fcl::Vector3d&) {
    return {guess(at, 0)};
  }
  double slack(const At& a, const At& b) const;
  double farthest(const At& a, const At& b, const Sample& from, const Sample& to) const;
  double gapError(double distance) const { return slack_.ofGap(distance, 0x1p-44); }

 private:
  fcl::Vector3d support(const At& at, const fcl::Vector3d& direction) const;
  double height(const At& at, const fcl::Vector3d& x) const;
};

/// The plane of a moving plane or half-space: normal * x = offset. On a straight path both change
/// evenly; on a screw the normal keeps the length 1.
struct PlaneAt {
  fcl::Vector3d normal;
  double offset;

  PlaneAt(const MovingBody& body, double t);
};

}  // namespace adaptive_bvh
