// Distances and separations of pairs of moving parts.
#include "ccd/moving_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "solids/solid_pair.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// Barycentric coordinates of a point of a triangle: not negative, with the sum 1. Any others would
/// give a valid, but larger, upper bound.
Vector weightsOf(const Triangle& t, const Vector& x) {
  const Vector u = t[1] - t[0], v = t[2] - t[0], w = x - t[0];
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w),
               vw = v.dot(w), across = uu * vv - uv * uv;
  if (!(across > 0)) {
    const double along = uu > vv ? uw / uu : vw / vv;
    const double share = along > 0 ? std::min(along, 1.) : 0;
    return uu > vv ? Vector(1 - share, share, 0) : Vector(1 - share, 0, share);
  }
  Vector weights(0, (uw * vv - vw * uv) / across, (vw * uu - uw * uv) / across);
  weights[0] = 1 - weights[1] - weights[2];
  weights = weights.cwiseMax(0);
  return weights / weights.sum();
}
Vector averageOf(const Triangle& t, const Vector& weights) {
  return weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2];
}

/// A shape at one time.
class SolidAt final : public ConvexSet {
 public:
  SolidAt(const Solid& solid, const FrameAt& frame) : solid_(solid), frame_(frame) {}
  Vector support(const Vector& direction) const override {
    return frame_(solid_.support(frame_.linear.transpose() * direction));
  }

 private:
  const Solid& solid_;
  const FrameAt& frame_;
};

Vector toFrame(const FrameAt& frame, const Vector& x) {
  return frame.linear.transpose() * (x - frame.translation);
}
fcl::Transform3d transformOf(const FrameAt& frame) {
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.linear() = frame.linear;
  tf.translation() = frame.translation;
  return tf;
}

/// The gap of a triangle and a rigid shape.
TriangleGap rigidGap(const Triangle& triangle, const Solid& solid, const FrameAt& frame) {
  TriangleGap gap = solid.gap(
      {toFrame(frame, triangle[0]), toFrame(frame, triangle[1]), toFrame(frame, triangle[2])});
  gap.points = {frame(gap.points.first), frame(gap.points.second)};
  return gap;
}

/// Upper bound of the distance of two points of parts that move evenly, while both points go evenly
/// from one place in their part to another: a quadratic Bezier curve is as near as its corners.
/// between(i, j): what is between the first places (i = 0) or the last ones, at the begin (j = 0)
/// or at the end.
template <typename Between>
double farthestOf(const Between& between) {
  return std::max(
      {between(0, 0).norm(), ((between(0, 1) + between(1, 0)) / 2).norm(), between(1, 1).norm()});
}

double highestAlong(const Triangle& t, const Vector& n) {
  return std::max({n.dot(t[0]), n.dot(t[1]), n.dot(t[2])});
}

/// The part of n at right angles to an edge: of an edge of length 0, n.
Vector acrossEdge(const Vector& edge, const Vector& n) {
  const double square = edge.squaredNorm();
  return square > 0 ? Vector(n - edge * (edge.dot(n) / square)) : n;
}

/// The material point of a shape that is at x at the time of `at`; x if the frame has no inverse.
Vector materialPoint(const MovingBody::At& at, const Vector& x, const MovingBody::At& later) {
  const Vector local = at.frame.linear.partialPivLu().solve(x - at.frame.translation);
  return later.frame(local);
}

/// The nearest point of a triangle or a shape at the time of `sample`, where it is at another time.
template <typename Sample, typename At>
Vector firstPoint(const MovingBody& body, const Sample& sample, const At& then) {
  const Vector& x = sample.gap.points.first;
  return body.mesh() ? averageOf(then.triangle, weightsOf(sample.at.triangle, x))
                     : materialPoint(sample.at.a, x, then.a);
}

}  // namespace

Vector MovingTrianglePair::guess(const At& at, int i) {
  const Vector between = at.b[0] + at.b[1] + at.b[2] - at.a[0] - at.a[1] - at.a[2];
  if (i == 0) return between.stableNormalized();
  const Triangle& t = i == 1 ? at.a : at.b;
  const Vector normal = (t[1] - t[0]).cross(t[2] - t[0]).stableNormalized();
  return normal.dot(between) < 0 ? Vector(-normal) : normal;
}

std::array<Vector, 17> MovingTrianglePair::manyGuesses(const At& at, const Vector& n) {
  std::array<Vector, 17> directions;
  const auto edges1 = edgesOf(at.a), edges2 = edgesOf(at.b);
  directions[0] = edges1[0].cross(edges1[1]);
  directions[1] = edges2[0].cross(edges2[1]);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) directions[2 + 3 * i + j] = edges1[i].cross(edges2[j]);
  for (std::size_t i = 0; i < 3; ++i) {
    directions[11 + i] = acrossEdge(edges1[i], n);
    directions[14 + i] = acrossEdge(edges2[i], n);
  }
  for (Vector& direction : directions) {
    direction = direction.stableNormalized();
    if (direction.dot(n) < 0) direction = -direction;
  }
  return directions;
}

double MovingTrianglePair::farthest(const At& a, const At& b, const Sample& from,
                                    const Sample& to) const {
  const Vector of_first[2] = {weightsOf(from.at.a, from.gap.points.first),
                              weightsOf(to.at.a, to.gap.points.first)},
               of_second[2] = {weightsOf(from.at.b, from.gap.points.second),
                               weightsOf(to.at.b, to.gap.points.second)};
  const double most = farthestOf([&](int i, int j) -> Vector {
    const At& at = j == 0 ? a : b;
    return averageOf(at.b, of_second[i]) - averageOf(at.a, of_first[i]);
  });
  return most + slack(a, b) + gapError(most);
}

SolidPair::At SolidPair::at(double t) const {
  At at{t, first_.at(t), second_.at(t), {}};
  if (first_.mesh()) at.triangle = first_.triangle(parts_.first, at.a);
  return at;
}

TriangleGap SolidPair::gap(const At& at) const {
  const bool is_rigid = second_.frame().isRigid();
  if (first_.mesh() && is_rigid) return rigidGap(at.triangle, *second_.solid(), at.b.frame);
  if (!first_.mesh() && is_rigid && first_.frame().isRigid())
    return gapOf(PlacedSolid{*first_.solid(), transformOf(at.a.frame)},
                 PlacedSolid{*second_.solid(), transformOf(at.b.frame)});
  const SolidAt second(*second_.solid(), at.b.frame);
  const ConvexGap found = first_.mesh() ? convexGap(at.triangle, second)
                                        : convexGap(SolidAt(*first_.solid(), at.a.frame), second);
  return {found.points, found.distance};
}

double SolidPair::separation(const At& at, const Vector& n) const {
  const double first =
      first_.mesh() ? highestAlong(at.triangle, n) : n.dot(first_.support(at.a, n));
  return n.dot(second_.support(at.b, -n)) - first;
}

Vector SolidPair::guess(const At& at, int) const {
  const Vector middle = first_.mesh()
                            ? Vector((at.triangle[0] + at.triangle[1] + at.triangle[2]) / 3)
                            : at.a.frame(first_.middle());
  return (at.b.frame(second_.middle()) - middle).stableNormalized();
}

double SolidPair::farthest(const At& a, const At& b, const Sample& from, const Sample& to) const {
  const double most = farthestOf([&](int i, int j) -> Vector {
    const Sample& sample = i == 0 ? from : to;
    const At& at = j == 0 ? a : b;
    return materialPoint(sample.at.b, sample.gap.points.second, at.b) -
           firstPoint(first_, sample, at);
  });
  return most + slack(a, b) + gapError(most);
}

PlaneAt::PlaneAt(const MovingBody& body, double t) {
  const FlatSolid& flat = *body.flat();
  const auto planeOf = [&](const FrameAt& frame) {
    normal = frame.linear * flat.normal();
    offset = flat.offset() + normal.dot(frame.translation);
  };
  planeOf(body.frame().at(body.frame().isRigid() ? t : 0));
  if (body.frame().isRigid()) return;
  const Vector first_normal = (1 - t) * normal;
  const double first_offset = (1 - t) * offset;
  planeOf(body.frame().at(1));
  normal = first_normal + t * normal;
  offset = first_offset + t * offset;
}

FlatPair::At FlatPair::at(double t) const {
  const PlaneAt plane(second_, t);
  At at{t, first_.at(t), {}, plane.normal, plane.offset};
  if (first_.mesh()) at.triangle = first_.triangle(parts_.first, at.a);
  return at;
}

Vector FlatPair::support(const At& at, const Vector& direction) const {
  if (!first_.mesh()) return first_.support(at.a, direction);
  const double most = highestAlong(at.triangle, direction);
  for (const Vector& x : at.triangle)
    if (direction.dot(x) == most) return x;
  return at.triangle[0];
}

/// The height of a point above the plane.
double FlatPair::height(const At& at, const Vector& x) const {
  return (at.normal.dot(x) - at.offset) / at.normal.norm();
}

TriangleGap FlatPair::gap(const At& at) const {
  const Vector low = support(at, -at.normal), high = support(at, at.normal),
               n = at.normal.stableNormalized();
  const double lowest = height(at, low), highest = height(at, high);
  if (lowest > 0) return {{low, low - lowest * n}, lowest};
  if (!second_.flat()->isSolid() && highest < 0) return {{high, high - highest * n}, -highest};
  const Vector met = second_.flat()->isSolid() || !(lowest < highest)
                         ? low
                         : Vector(low + lowest / (lowest - highest) * (high - low));
  return {{met, met}, 0};
}

/// Below a half-space's plane there is no separation.
double FlatPair::separation(const At& at, const Vector& n) const {
  const bool is_above = second_.flat()->isSolid() || n.dot(at.normal) < 0;
  return is_above ? height(at, support(at, -at.normal)) : -height(at, support(at, at.normal));
}

double FlatPair::slack(const At& a, const At& b) const {
  double motion = 0, arm = 0;  // of the first part
  if (first_.mesh()) {
    for (std::size_t k = 0; k < 3; ++k) {
      motion = std::max(motion, (b.triangle[k] - a.triangle[k]).norm());
      arm = std::max({arm, second_.frame().angleTimesArm(a.triangle[k]),
                      second_.frame().angleTimesArm(b.triangle[k])});
    }
  } else {
    const Vector from = a.a.frame(first_.middle()), to = b.a.frame(first_.middle());
    const double radius = first_.radius();
    motion = (to - from).norm() + (b.a.frame.linear - a.a.frame.linear).norm() * radius;
    arm = std::max(second_.frame().angleTimesArm(from), second_.frame().angleTimesArm(to)) +
          second_.frame().angle() * radius;
  }
  const double length = b.t - a.t, turn = (b.normal - a.normal).norm();
  const double least = std::min(a.normal.norm(), b.normal.norm()) - turn;
  if (!(least > 0)) return std::numeric_limits<double>::infinity();
  const double arcs = second_.frame().angle() * length * length / 8 *
                      (arm + second_.frame().angle() * first_.arc(length));
  return (turn * (motion / 4) + arcs) / least * (1 + 1e-9) + slack_(length);
}

/// The height of a point that goes evenly in its part, times the normal's length, is a cubic Bezier
/// curve, which is as near as its corners.
double FlatPair::farthest(const At& a, const At& b, const Sample& from, const Sample& to) const {
  const Vector first = firstPoint(first_, from, a), last = firstPoint(first_, to, b),
               middle = (firstPoint(first_, from, b) + firstPoint(first_, to, a)) / 2;
  const double least = std::min(a.normal.norm(), b.normal.norm()) - (b.normal - a.normal).norm();
  double most = 0;
  for (const double height :
       {a.normal.dot(first) - a.offset,
        (2 * (a.normal.dot(middle) - a.offset) + b.normal.dot(first) - b.offset) / 3,
        (a.normal.dot(last) - a.offset + 2 * (b.normal.dot(middle) - b.offset)) / 3,
        b.normal.dot(last) - b.offset})
    most = std::max(most, second_.flat()->isSolid() ? height : std::fabs(height));
  most /= std::max(least, 0.);
  return most + slack(a, b) + gapError(most);
}

}  // namespace adaptive_bvh
