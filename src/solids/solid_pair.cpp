#include "solids/solid_pair.h"

#include <utility>

#include "base/rigid.h"
#include "solids/flat.h"
#include "solids/rounded_segment.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// A shape in the frame of another shape, through its support function.
class PlacedSet final : public ConvexSet {
 public:
  PlacedSet(const PlacedSolid& placed, const fcl::Transform3d& frame)
      : solid_(placed.solid), to_frame_(frame, placed.tf) {}
  Vector support(const Vector& direction) const override {
    return to_frame_(solid_.support(to_frame_.R.transpose() * direction));
  }

 private:
  const Solid& solid_;
  const RelativePlacement to_frame_;
};

/// The pair of a sphere or capsule and another shape, in that shape's frame. A capsule is a segment
/// with a radius, and the segment is treated as a degenerate triangle; a sphere is a point.
class SegmentPair {
 public:
  SegmentPair(const RoundedSegment& rounded, const fcl::Transform3d& tf, const PlacedSolid& other)
      : radius_(rounded.radius()), other_(other) {
    const RelativePlacement to_other(other.tf, tf);
    const Vector a = to_other(rounded.end()), b = to_other(Vector(-rounded.end()));
    is_point_ = rounded.end().isZero(0);
    segment_ = {a, b, b};
  }

  TriangleGap gap() const {
    if (is_point_) return gapOfBall();
    TriangleGap gap = other_.solid.gap(segment_);
    return gap.distance > radius_ ? rounded(gap) : touching(gap.points.second);
  }

  /// Whether the pair touches; if so, sets the contact. The normal points from the segment to the
  /// shape.
  bool touches(ShapeContact& contact) const {
    if (is_point_) return touchesBall(contact);
    const TriangleGap gap = other_.solid.gap(segment_);
    if (gap.distance > radius_) return false;
    if (gap.distance > 0) {
      const Vector normal = separatingNormal(gap);
      contact = {gap.points.second, normal, depthAlong(normal, gap)};
    } else {
      other_.solid.touches(segment_, contact);
      contact.depth += radius_;
    }
    return true;
  }

 private:
  /// `gap` and `touches` of a sphere, by `surface`, which measures from either side of a plane.
  TriangleGap gapOfBall() const {
    const Vector& x = segment_[0];
    const ShapeSurface found = other_.solid.surface(x);
    if (found.distance > radius_) return rounded({{x, found.nearest}, found.distance});
    return touching(found.distance > 0 ? found.nearest : x);
  }
  bool touchesBall(ShapeContact& contact) const {
    const Vector& x = segment_[0];
    const ShapeSurface found = other_.solid.surface(x);
    if (found.distance > radius_) return false;
    contact = {found.distance > 0 ? found.nearest : x, -found.outward, radius_ - found.distance};
    return true;
  }
  /// The separating direction from the segment to the shape. The difference of near points is
  /// inaccurate; the normal of a separating plane is not.
  Vector separatingNormal(const TriangleGap& gap) const {
    const Vector between = gap.points.second - gap.points.first;
    if (const FlatSolid* const flat = other_.solid.flat())
      return between.dot(flat->normal()) < 0 ? Vector(-flat->normal()) : flat->normal();
    const Vector normal = -convexGap(segment_, other_.solid).normal;
    return normal.isZero(0) ? Vector(between.stableNormalized()) : normal;
  }
  /// The depth of the capsule and the shape along a unit normal from the segment to the shape.
  double depthAlong(const Vector& normal, const TriangleGap& gap) const {
    if (other_.solid.flat()) return radius_ - gap.distance;
    const double end = std::max(normal.dot(segment_[0]), normal.dot(segment_[1]));
    return std::max(0., radius_ + end - normal.dot(other_.solid.support(-normal)));
  }
  /// The gap of the capsule, given that of its segment.
  TriangleGap rounded(TriangleGap gap) const {
    gap.points.first += (gap.points.second - gap.points.first) * (radius_ / gap.distance);
    gap.distance -= radius_;
    return gap;
  }
  /// The gap of shapes with the common point x.
  static TriangleGap touching(const Vector& x) { return {{x, x}, 0}; }

  const double radius_;
  const PlacedSolid& other_;
  bool is_point_;     ///< a sphere
  Triangle segment_;  ///< in the frame of the other shape
};

/// The points of `other` that are lowest and highest above the plane of `flat`, in the frame of
/// `flat`, as a degenerate triangle.
Triangle extremesAbove(const PlacedSolid& flat, const PlacedSolid& other) {
  const PlacedSet set(other, flat.tf);
  const Vector& n = flat.solid.flat()->normal();
  const Vector lowest = set.support(-n), highest = set.support(n);
  return {lowest, highest, highest};
}

/// A pair of planes or half-spaces, in the world.
class FlatPair {
 public:
  FlatPair(const PlacedSolid& first, const PlacedSolid& second)
      : a_(*first.solid.flat()), b_(*second.solid.flat()) {
    n_ = first.tf.linear() * a_.normal();
    m_ = second.tf.linear() * b_.normal();
    on_first_ = first.tf * Vector(a_.offset() * a_.normal());
    on_second_ = second.tf * Vector(b_.offset() * b_.normal());
    is_parallel_ = n_.cross(m_).norm() <= kParallel;
    height_ = n_.dot(on_second_ - on_first_);
  }

  /// The distance by which the second must move along `n_`, or against it, to be apart: infinite if
  /// no distance suffices. If they are already apart, minus their gap.
  double depthUp() const {
    const bool is_endless_below = b_.isSolid() && n_.dot(m_) > 0;
    return is_parallel_ && !is_endless_below ? -height_ : kInfinity;
  }
  double depthDown() const {
    const bool is_endless_above = b_.isSolid() && n_.dot(m_) < 0;
    return is_parallel_ && !is_endless_above && !a_.isSolid() ? height_ : kInfinity;
  }
  /// The penetration depth; negative if they are apart.
  double depth() const { return std::min(depthUp(), depthDown()); }

  TriangleGap gap() const {
    const double depth = this->depth();
    if (depth >= 0) return {{common(), common()}, 0};
    return {{on_second_ - height_ * n_, on_second_}, -depth};
  }
  ShapeContact contact() const {
    return {common(), depthUp() <= depthDown() ? n_ : Vector(-n_), depth()};
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  /// A common point: the point of both planes' line nearest to the second's reference point. For
  /// parallel planes, that point itself or its projection on the first plane.
  Vector common() const {
    if (is_parallel_) return a_.isSolid() && height_ <= 0 ? on_second_ : on_second_ - height_ * n_;
    const Vector in_second = (n_ - n_.dot(m_) * m_).normalized();
    return on_second_ - in_second * (height_ / n_.dot(in_second));
  }

  const FlatSolid &a_, &b_;
  Vector n_, m_;                 ///< unit normals of the first and the second
  Vector on_first_, on_second_;  ///< a reference point on each plane
  bool is_parallel_;
  double height_;  ///< height of the second's plane above the first's
};

/// Whether to swap the pair, so that a sphere or capsule comes first and a flat shape second.
bool isSwapped(const PlacedSolid& first, const PlacedSolid& second) {
  if (first.solid.flat() || second.solid.flat()) return first.solid.flat();
  return second.solid.roundedSegment() && !first.solid.roundedSegment();
}

// The results of the functions below are in the frame of the second shape. Only the second may be
// flat, and if one of the two is a sphere or capsule, the first is (isSwapped).

TriangleGap gapInFrame(const PlacedSolid& first, const PlacedSolid& second) {
  if (const RoundedSegment* segment = first.solid.roundedSegment())
    return SegmentPair(*segment, first.tf, second).gap();
  if (second.solid.flat()) return second.solid.gap(extremesAbove(second, first));
  const ConvexGap gap = convexGap(PlacedSet(first, second.tf), second.solid);
  return {gap.points, gap.distance};
}

bool touchInFrame(const PlacedSolid& first, const PlacedSolid& second, ShapeContact& contact) {
  if (const RoundedSegment* segment = first.solid.roundedSegment())
    return SegmentPair(*segment, first.tf, second).touches(contact);
  if (second.solid.flat()) return second.solid.touches(extremesAbove(second, first), contact);
  const PlacedSet a(first, second.tf);
  const Solid& b = second.solid;
  const ConvexGap gap = convexGap(a, b);
  if (gap.distance > 0) return false;
  const Penetration shortest = penetrationOf(a, b);
  contact = {gap.points.first, shortest.normal, shortest.depth};
  return true;
}

}  // namespace

TriangleGap gapOf(const PlacedSolid& first, const PlacedSolid& second) {
  if (first.solid.flat() && second.solid.flat()) return FlatPair(first, second).gap();
  const bool is_swapped = isSwapped(first, second);
  const PlacedSolid &a = is_swapped ? second : first, &b = is_swapped ? first : second;
  TriangleGap gap = gapInFrame(a, b);
  gap.points = {b.tf * gap.points.first, b.tf * gap.points.second};
  if (is_swapped) std::swap(gap.points.first, gap.points.second);
  return gap;
}

bool touch(const PlacedSolid& first, const PlacedSolid& second, ShapeContact& contact) {
  if (first.solid.flat() && second.solid.flat()) {
    contact = FlatPair(first, second).contact();
    return contact.depth >= 0;
  }
  const bool is_swapped = isSwapped(first, second);
  const PlacedSolid &a = is_swapped ? second : first, &b = is_swapped ? first : second;
  if (!touchInFrame(a, b, contact)) return false;
  contact.position = b.tf * contact.position;
  contact.normal = (is_swapped ? -1. : 1.) * (b.tf.linear() * contact.normal);
  return true;
}

}  // namespace adaptive_bvh
