#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The side of a closed surface on which a point lies, as far as it is known.
enum class SurfaceSide : std::uint8_t { Unknown, Outside, Inside };

/// A point of the source, or near it, in the target's frame, and its measured distance.
/// (DepthSearch describes source and target.)
template <typename Witness>
struct DepthPoint {
  fcl::Vector3d x;
  fcl::Vector3d parameter = fcl::Vector3d::Zero();  ///< where it is on a curved surface
  double distance = -1;                             ///< to the target's surface; -1: not measured
  Witness witness{};                                ///< feature of the target at that distance
  SurfaceSide side = SurfaceSide::Unknown;

  bool isMeasured() const { return distance >= 0; }
};

/// A box that encloses part of a surface: its centre and half its sides, in the target's frame.
struct OrientedBox {
  fcl::Vector3d middle;
  fcl::Matrix3d halves;  ///< half sides, as columns

  /// Radius of a ball around the centre that contains the corners. Also valid for sides that are
  /// orthogonal only up to the rounding of a rotation.
  double radius() const { return std::sqrt((halves.transpose() * halves).cwiseAbs().sum()); }
};

/// Bounds of the depth of one surface, the source, in a closed body, the target.
struct DepthBounds {
  double lower = 0, upper = 0;
  bool is_found = false;     ///< whether a point deeper than the initial bound was found
  fcl::Vector3d x;           ///< that point of the source; its depth is `lower`
  fcl::Vector3d nearest;     ///< point of the target's surface
  fcl::Vector3d outward;     ///< outward normal of that surface there
  std::size_t searches = 0;  ///< number of searches for the distance of a point

  /// Bounds without a point. Depths below `depth` do not matter.
  static DepthBounds from(double depth) {
    DepthBounds bounds;
    bounds.lower = bounds.upper = depth;
    return bounds;
  }
};

/// Returns the bounds given by one point of a source, if it is deeper than `least` in the target;
/// else DepthBounds::from(least).
template <typename Target>
DepthBounds depthAt(const fcl::Vector3d& x, Target& target, double least) {
  DepthPoint<typename Target::Witness> point;
  point.x = x;
  target.measure(point, {});
  DepthBounds bounds = DepthBounds::from(least);
  if (!(point.distance > least) || !target.isInside(x)) return bounds;
  bounds.lower = bounds.upper = point.distance;
  bounds.is_found = true;
  bounds.x = x;
  target.findNearest(point, bounds);
  return bounds;
}

/// Chooses where DepthSearch cuts a triangle with measured corners: an edge, and a share of its
/// length.
///
/// The cut is made where the nearest feature of the target changes from that of one end of the edge
/// to that of the other, because each feature bounds its half better; or where the edge crosses the
/// surface or leaves a flat part of it, because one half is then outside. If there is no such
/// point, or if `halves` is set, the longest edge is halved.
template <typename Target>
class DepthCut {
 public:
  using Point = DepthPoint<typename Target::Witness>;

  /// length(p, q): the length of an edge.
  template <typename Length>
  DepthCut(const Point* const (&corners)[3], const Target& target, double tolerance, bool halves,
           const Length& length)
      : corners_(corners), target_(target), tolerance_(tolerance), best_gain_(tolerance / 8) {
    for (int k = 0; k < 3 && !halves; ++k) considerEdge(k);
    if (edge_ < 0) halveLongest(length);
  }

  /// The edge from this corner to the next one.
  int edge() const { return edge_; }
  /// Where to cut the edge, from 0 to 1.
  double share() const { return share_; }

 private:
  const Point& corner(int k) const { return *corners_[k % 3]; }

  template <typename Length>
  void halveLongest(const Length& length) {
    double longest = -1;
    for (int k = 0; k < 3; ++k) {
      const double other = length(corner(k), corner(k + 1));
      if (other > longest) edge_ = k, longest = other;
    }
  }
  void considerEdge(int k) {
    const Point &a = corner(k), &b = corner(k + 1);
    const auto bound_a = target_.boundBy(a.witness), bound_b = target_.boundBy(b.witness);
    const double gain = std::min(bound_b(a.x) - bound_a(a.x), bound_a(b.x) - bound_b(b.x));
    if (gain > best_gain_) offer(k, gain, changeBetween(a.x, b.x, bound_a, bound_b));
    considerBorder(a, b, bound_a, [&](double g, double t) { offer(k, g, t); });
    considerBorder(b, a, bound_b, [&](double g, double t) { offer(k, g, 1 - t); });
  }
  /// Chooses this cut if it is the best so far. `gain`: amount by which the bounds may improve.
  void offer(int edge, double gain, double share) {
    const double length = (corner(edge + 1).x - corner(edge).x).norm();
    // If the cut is nearer to an end, the edge was already cut there.
    const bool is_new = std::min(share, 1 - share) * length > tolerance_ / 8;
    if (gain > best_gain_ && is_new) edge_ = edge, best_gain_ = gain, share_ = share;
  }
  /// Calls found(gain, t) where the segment from a to b crosses the nearest feature of a, or, if a
  /// is on that feature, leaves it. `bound`: by that feature.
  template <typename WitnessBound, typename Found>
  void considerBorder(const Point& a, const Point& b, const WitnessBound& bound,
                      const Found& found) const {
    const double zero = tolerance_ / 16;  // nearer points count as on the surface
    const double at_b = bound(b.x);
    if (a.distance > zero) {
      const double t = target_.crossing(a.witness, a.x, b.x);
      if (t > 0 && t < 1 && bound(a.x + t * (b.x - a.x)) <= zero)
        found(std::min(a.distance, at_b), t);
    } else if (at_b > 2 * zero) {
      double low = 0, high = 1;
      for (int i = 0; i < 50; ++i) {
        const double t = (low + high) / 2;
        (bound(a.x + t * (b.x - a.x)) <= zero / 64 ? low : high) = t;
      }
      found(at_b, high);
    }
  }
  /// Returns where on the segment from a to b their nearest features are equally far, from 0 (at a)
  /// to 1: by regula falsi (Illinois), with a bisection at every fourth step.
  template <typename WitnessBound>
  static double changeBetween(const fcl::Vector3d& a, const fcl::Vector3d& b,
                              const WitnessBound& bound_a, const WitnessBound& bound_b) {
    const auto excess = [&](double t) {
      const fcl::Vector3d x = a + t * (b - a);
      return bound_a(x) - bound_b(x);
    };
    double low = 0, high = 1, at_low = excess(0), at_high = excess(1);
    int last_side = 0;
    for (int i = 0; i < 60 && at_low < 0 && at_high > 0; ++i) {
      const double t =
          i % 4 == 3 ? (low + high) / 2 : low + (high - low) * (at_low / (at_low - at_high));
      if (!(t > low && t < high)) break;
      const double value = excess(t);
      if (value == 0) return t;
      const int side = value < 0 ? -1 : 1;
      double& kept = side < 0 ? at_high : at_low;
      (side < 0 ? low : high) = t;
      (side < 0 ? at_low : at_high) = value;
      if (side == last_side) kept /= 2;  // the Illinois step
      last_side = side;
    }
    return at_low > -at_high ? low : high;
  }

  const Point* const (&corners_)[3];
  const Target& target_;
  const double tolerance_;
  double best_gain_;
  int edge_ = -1;  ///< -1: none yet
  double share_ = 0.5;
};

}  // namespace adaptive_bvh
