#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "base/leased.h"
#include "query/depth/cutting_planes.h"
#include "query/depth/depth_bounds.h"
#include "triangles/surface_chart.h"

namespace adaptive_bvh {

/// Finds the largest distance to a target's surface of all points of a source inside the target:
/// branch and bound over boxes and triangles of the source, largest upper bound first. Similar to
/// one-sided Hausdorff distances (Guthe, Borodin and Klein 2005; Tang, Lee and Kim 2009), but only
/// of the points inside. docs/bounds.md, 19.
///
/// The source is a surface, in the target's frame. Functions that it provides:
///   start(search)               adds the first boxes or triangles
///   openBox(node, lane, search, hint)  adds the children of a box
///   boxOf(node, lane)           the box
///   between(a, b, t, chart, parameter)  the point at t on the edge from a to b; its parameter
///   length(a, b, chart)         the length of that edge
///   bulge(a, b, c, chart)       how far a curved patch deviates from its triangle; `chart` is the
///                               patch's part of the surface (0 for a mesh)
/// The target is a closed body. Witness names a feature of its surface. kIsConvex, and:
///   measure(point, hint)        sets the point's distance to the surface and its nearest feature
///   boundBy(witness)            a convex function of a point, nowhere less than its depth
///   overBox(bound, box)         the largest value of such a function in a box
///   isInside(x)                 whether a point is inside
///   isClear(middle, radius)     whether a ball is certainly outside
///   touches(triangle, bulge)    whether a patch may touch the surface
///   crossing(witness, a, b)     where a segment crosses the feature's plane, from 0 to 1; else -1
///   planeOf(witness)            that plane: outward normal n and offset d (not if convex)
///   findNearest(point, bounds)  sets nearest point and outward normal for a measured point
template <typename Source, typename Target>
class DepthSearch {
 public:
  using Witness = typename Target::Witness;
  using Point = DepthPoint<Witness>;

  /// Searches until the bounds differ by at most `tolerance`. `known`: an initial lower bound,
  /// perhaps with its point of the source. Depths below it do not matter.
  DepthSearch(Source& source, Target& target, double tolerance, const DepthBounds& known)
      : source_(source), target_(target), tolerance_(tolerance) {
    memory_->points.clear();
    memory_->open.clear();
    bounds_ = known;
    bounds_.searches = 0;
  }
  DepthSearch(const DepthSearch&) = delete;
  DepthSearch& operator=(const DepthSearch&) = delete;

  /// Returns the bounds, and the deepest point if one is deeper than `known`.
  DepthBounds run() {
    source_.start(*this);
    while (!memory_->open.empty() && memory_->open.front().upper > limit()) {
      const Part top = memory_->open.front();
      std::pop_heap(memory_->open.begin(), memory_->open.end());
      memory_->open.pop_back();
      top.isBox() ? openBox(top) : openTriangle(top);
    }
    if (!memory_->open.empty()) drop(memory_->open.front().upper);
    bounds_.upper = std::max(bounds_.lower, dropped_);
    if (deepest_ >= 0) {
      bounds_.is_found = true;
      bounds_.x = point(deepest_).x;
      target_.findNearest(point(deepest_), bounds_);
    }
    return bounds_;
  }

  // The source calls the following functions.

  /// Adds a point that is not yet measured; returns its number.
  int add(const fcl::Vector3d& x, const fcl::Vector3d& parameter = fcl::Vector3d::Zero()) {
    Point added;
    added.x = x;
    added.parameter = parameter;
    memory_->points.push_back(added);
    return static_cast<int>(memory_->points.size()) - 1;
  }
  /// Adds a point that need not be on the source's surface, and measures it.
  int addMeasured(const fcl::Vector3d& x, int hint) {
    const int added = add(x);
    measure(added, hint);
    return added;
  }
  /// Adds a child of the box that is being opened. `hint`: number of a measured point that is near.
  void addBox(int node, int lane, int hint) {
    const OrientedBox box = source_.boxOf(node, lane);
    if (target_.isClear(box.middle, box.radius())) return;
    const auto bound = target_.boundBy(witnessOf(hint));
    const double upper = std::min(upper_, overBox(bound, box, bound(box.middle)));
    push({upper, {node, lane, kNone}, hint, 0, 0, is_inside_, false});
  }
  /// Adds a triangle, or a curved patch, of the source, given by the numbers of its corners.
  void addTriangle(int a, int b, int c, std::uint8_t chart, int hint) {
    Part part = {upper_, {a, b, c}, hint, 0, chart, is_inside_, false};
    part.upper = std::min(upper_, overPatch(part, witnessOf(hint), bulgeOf(part)));
    push(part);
  }

 private:
  static constexpr int kNone = -1;

  /// A part of the source: a box, or a triangle.
  struct Part {
    double upper;              ///< upper bound of the depth of all its points
    int corners[3];            ///< numbers of points; for a box: node, lane, kNone
    int hint;                  ///< number of a measured point that is near
    std::uint16_t generation;  ///< of a triangle: counts the steps of openTriangle() and the cuts
    std::uint8_t chart;
    bool is_inside;  ///< whether all of it is certainly inside
    bool is_clear;   ///< whether it certainly does not cross the surface

    bool isBox() const { return corners[2] == kNone; }
    friend bool operator<(const Part& a, const Part& b) { return a.upper < b.upper; }
  };
  struct Memory {
    std::vector<Point> points;
    std::vector<Part> open;  ///< a heap, largest upper bound first
  };

  Point& point(int i) { return memory_->points[static_cast<std::size_t>(i)]; }
  const Point& point(int i) const { return memory_->points[static_cast<std::size_t>(i)]; }
  const Witness& witnessOf(int i) const { return point(i).witness; }
  /// Parts whose upper bound is at most this are left out.
  double limit() const { return bounds_.lower + tolerance_; }

  /// Length of the motion in isOutsideMoved: less than limit() by more than the rounding error.
  double motionLength() const { return bounds_.lower + 15. / 16 * tolerance_; }

  /// Records the bound of a part that is left out.
  void drop(double upper) { dropped_ = std::max(dropped_, upper); }
  void push(const Part& part) {
    if (part.upper <= limit()) return drop(part.upper);
    memory_->open.push_back(part);
    std::push_heap(memory_->open.begin(), memory_->open.end());
  }

  void measure(int i, int hint) {
    ++bounds_.searches;
    target_.measure(point(i), hint == kNone ? Witness{} : witnessOf(hint));
  }
  /// The side of a measured point, computed once.
  SurfaceSide sideOf(int i) {
    Point& p = point(i);
    if (p.side == SurfaceSide::Unknown)
      p.side = p.distance > 0 && target_.isInside(p.x) ? SurfaceSide::Inside : SurfaceSide::Outside;
    return p.side;
  }
  /// Measures a point of the surface, and raises the lower bound if the point is deeper.
  void measureCorner(int i, const Part& part) {
    if (point(i).isMeasured()) return;
    measure(i, part.hint);
    if (part.is_inside) point(i).side = SurfaceSide::Inside;
    if (point(i).distance <= bounds_.lower || sideOf(i) != SurfaceSide::Inside) return;
    bounds_.lower = point(i).distance;
    deepest_ = i;
  }

  /// Measures a box's centre, and leaves the box out or adds its children.
  void openBox(const Part& part) {
    const OrientedBox box = source_.boxOf(part.corners[0], part.corners[1]);
    const int middle = addMeasured(box.middle, part.hint);
    const double radius = box.radius();
    const double distance = point(middle).distance;
    upper_ = std::min(part.upper, overBox(target_.boundBy(witnessOf(middle)), box, distance));
    is_inside_ = part.is_inside;
    if (upper_ > limit() && !is_inside_) useSide(middle, radius);
    if (upper_ > limit()) return source_.openBox(part.corners[0], part.corners[1], *this, middle);
    drop(upper_);
  }
  /// Upper bound for a box by a feature at the distance `at_middle` from its centre: by its
  /// bounding ball, and by its corners if only these may suffice to leave it out.
  template <typename WitnessBound>
  double overBox(const WitnessBound& bound, const OrientedBox& box, double at_middle) const {
    const double upper = at_middle + box.radius();
    if (upper <= limit() || at_middle > limit()) return upper;
    return std::min(upper, target_.overBox(bound, box));
  }
  /// Uses the side of a measured point, at a distance d from the surface, for a part within
  /// `radius` of it. If outside, the part is at most radius - d deep; if that exceeds the limit,
  /// the side is not computed. If inside and d > radius, all of the part is inside.
  void useSide(int i, double radius) {
    const double distance = point(i).distance, if_outside = radius - distance;
    if (if_outside > limit() && point(i).side == SurfaceSide::Unknown) return;
    if (sideOf(i) == SurfaceSide::Outside)
      upper_ = std::min(upper_, if_outside);
    else if (distance > radius)
      is_inside_ = true;
  }

  /// Opens a triangle: first measures its centroid, the next time its corners, then cuts it.
  void openTriangle(Part part) {
    if (part.generation > 1) {
      if (isOutside(part)) return drop(tolerance_ / 2);
      if constexpr (!Target::kIsConvex)
        if (isOutsideMoved(part)) return drop(motionLength());
      return cut(part);
    }
    if (++part.generation == 1) return pushByMiddle(part);
    if constexpr (Target::kIsConvex)
      if (isBoundedByPlanes(part)) return;
    for (const int i : part.corners) measureCorner(i, part);
    pushMeasured(part);
  }
  /// Adds a triangle again, with a bound by its measured centroid.
  void pushByMiddle(Part& part) {
    const fcl::Vector3d middle =
        (point(part.corners[0]).x + point(part.corners[1]).x + point(part.corners[2]).x) / 3;
    part.hint = addMeasured(middle, part.hint);
    double square = 0;
    for (const int i : part.corners) square = std::max(square, (point(i).x - middle).squaredNorm());
    const Bulge bulge = bulgeOf(part);
    const double radius = std::sqrt(square) + bulge.height;
    upper_ = std::min({part.upper, point(part.hint).distance + radius,
                       overPatch(part, witnessOf(part.hint), bulge)});
    is_inside_ = part.is_inside;
    if (upper_ > limit() && !is_inside_) useSide(part.hint, radius);
    part.upper = upper_;
    part.is_inside = is_inside_;
    push(part);
  }
  /// Whether cutting planes suffice to leave out a flat triangle. They apply because the depth in a
  /// convex target is a concave function.
  bool isBoundedByPlanes(Part& part) {
    constexpr int kMostPlanes = 100;
    CuttingPlanes planes;
    int last = part.hint;
    for (int i = 0; i < kMostPlanes; ++i) {
      const auto bound = target_.boundBy(witnessOf(last));
      planes.add({bound(point(part.corners[0]).x), bound(point(part.corners[1]).x),
                  bound(point(part.corners[2]).x)});
      part.upper = std::min(part.upper, planes.bound());
      if (part.upper <= limit()) {
        drop(part.upper);
        return true;
      }
      fcl::Vector3d x = fcl::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) x += planes.highest()[k] * point(part.corners[k]).x;
      last = add(x);
      measureCorner(last, part);
    }
    return false;
  }
  Bulge bulgeOf(const Part& part) const {
    return source_.bulge(point(part.corners[0]), point(part.corners[1]), point(part.corners[2]),
                         part.chart);
  }
  /// Upper bound for a patch by a feature's convex function: its value at a corner of the hull.
  double overPatch(const Part& part, const Witness& witness, const Bulge& bulge) const {
    const auto bound = target_.boundBy(witness);
    double most = -std::numeric_limits<double>::infinity();
    for (const int i : part.corners) {
      const fcl::Vector3d& x = point(i).x;
      most = std::max(most, bound(x));
      for (int k = 0; k < bulge.count; ++k)
        most = std::max(most, bound(x + bulge.offsets[static_cast<std::size_t>(k)]));
    }
    return most;
  }
  /// The largest amount by which the bulge raises the bound at a corner.
  double bulgeAbove(const Part& part) const {
    const Bulge bulge = bulgeOf(part);
    double most = 0;
    for (const int i : part.corners) {
      const auto bound = target_.boundBy(witnessOf(i));
      for (int k = 0; k < bulge.count; ++k)
        most = std::max(most, bound(point(i).x + bulge.offsets[static_cast<std::size_t>(k)]) -
                                  bound(point(i).x));
    }
    return most;
  }
  /// The largest distance from a corner to another one.
  double radiusAt(const Part& part, int corner) const {
    double square = 0;
    for (const int other : part.corners)
      square = std::max(square, (point(other).x - point(corner).x).squaredNorm());
    return std::sqrt(square);
  }
  /// Adds a triangle with measured corners, with bounds by their features, distances and sides.
  void pushMeasured(Part& part) {
    const Bulge bulge = bulgeOf(part);
    upper_ = part.upper;
    is_inside_ = part.is_inside;
    for (const int i : part.corners) {
      if (upper_ <= limit()) break;
      upper_ = std::min({upper_, overPatch(part, witnessOf(i), bulge),
                         point(i).distance + radiusAt(part, i) + bulge.height});
    }
    for (const int i : part.corners) {
      if (upper_ <= limit() || is_inside_) break;
      useSide(i, radiusAt(part, i) + bulge.height);
    }
    part.upper = upper_;
    part.is_inside = is_inside_;
    push(part);
  }

  /// Whether a triangle is outside, except for points less than half the tolerance deep: shrunk so
  /// that no corner moves farther, it does not touch the surface, and its centroid is outside.
  bool isOutside(Part& part) {
    if (part.is_inside || part.is_clear) return false;
    fcl::Vector3d corners[3], middle = fcl::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) middle += point(part.corners[k]).x / 3;
    double radius = 0;
    for (int k = 0; k < 3; ++k)
      radius = std::max(radius, (point(part.corners[k]).x - middle).norm());
    const double share = tolerance_ / 2 / radius;
    for (int k = 0; k < 3; ++k)
      corners[k] =
          point(part.corners[k]).x + std::min(share, 1.) * (middle - point(part.corners[k]).x);
    if (target_.touches({corners[0], corners[1], corners[2]}, bulgeOf(part))) return false;
    part.is_clear = true;
    return !target_.isInside(middle);
  }

  /// Whether a triangle is outside once it is moved by motionLength() along the outward normal of a
  /// corner's nearest feature. Then no point of it is deeper than that length. Only tried if the
  /// motion takes the triangle beyond the feature's plane.
  bool isOutsideMoved(const Part& part) {
    if (part.is_inside) return false;  // its features bound it equally well
    const Bulge bulge = bulgeOf(part);
    for (const int i : part.corners) {
      const auto plane = target_.planeOf(witnessOf(i));
      const fcl::Vector3d motion = motionLength() * plane.n;
      std::array<fcl::Vector3d, 3> moved;
      double lowest = std::numeric_limits<double>::infinity(), below = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        moved[k] = point(part.corners[k]).x + motion;
        lowest = std::min(lowest, plane.n.dot(moved[k]));
      }
      for (int k = 0; k < bulge.count; ++k)
        below = std::min(below, plane.n.dot(bulge.offsets[static_cast<std::size_t>(k)]));
      if (lowest + below > plane.d && !target_.touches(moved, bulge) &&
          !target_.isInside((moved[0] + moved[1] + moved[2]) / 3))
        return true;
    }
    return false;
  }

  /// Cuts a triangle in two, from a point of an edge to the opposite corner, and adds both halves.
  void cut(const Part& part) {
    const Point* const corners[3] = {&point(part.corners[0]), &point(part.corners[1]),
                                     &point(part.corners[2])};
    const bool is_curved = bulgeAbove(part) > tolerance_ / 4;
    const auto length = [&](const Point& p, const Point& q) {
      return is_curved ? source_.bulge(p, q, q, part.chart).height
                       : source_.length(p, q, part.chart);
    };
    // Of a curved patch, the edge with the largest bulge is halved, because DepthCut finds changes
    // of features only on straight edges. Every third cut halves the longest edge, so that
    // triangles become small.
    const DepthCut<Target> chosen(corners, target_, tolerance_,
                                  is_curved || part.generation % 3 == 0, length);
    const int edge = chosen.edge();
    const int a = part.corners[edge], b = part.corners[(edge + 1) % 3],
              c = part.corners[(edge + 2) % 3];
    fcl::Vector3d parameter = fcl::Vector3d::Zero();
    const fcl::Vector3d x =
        source_.between(point(a), point(b), chosen.share(), part.chart, parameter);
    const int middle = add(x, parameter);
    measureCorner(middle, part);
    Part half = part;
    ++half.generation;
    half.hint = middle;
    for (const int end : {a, b}) {
      half.upper = part.upper;
      half.is_inside = part.is_inside;
      half.corners[0] = end == a ? a : middle;
      half.corners[1] = end == a ? middle : b;
      half.corners[2] = c;
      pushMeasured(half);
    }
  }

  Source& source_;
  Target& target_;
  const double tolerance_;
  const Leased<Memory> memory_;
  DepthBounds bounds_;
  int deepest_ = kNone;  ///< number of the point whose depth is bounds_.lower; kNone: `known`'s
  double dropped_ = 0;   ///< largest upper bound of the parts left out
  /// Upper bound of the part that is being opened, and whether all of it is inside. Both are
  /// inherited by its children.
  double upper_ = std::numeric_limits<double>::infinity();
  bool is_inside_ = false;
};

}  // namespace adaptive_bvh
