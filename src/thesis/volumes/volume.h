#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/math/bv/OBBRSS.h>
#include <fcl/math/bv/RSS.h>

#include "base/pack.h"
#include "base/rounding.h"
#include "mesh/mesh_view.h"

/// Hands every type of bounding volume that the library is compiled for to a macro, for explicit
/// instantiation.
#define ADAPTIVE_BVH_FOR_EACH_VOLUME(macro)                                \
  macro(fcl::RSS<float>) macro(fcl::RSS<double>) macro(fcl::OBBRSS<float>) \
      macro(fcl::OBBRSS<double>)

namespace adaptive_bvh {

/// What is special to one type of bounding volume. All other code uses only this, so another type
/// of volume is another specialisation.
template <typename BV>
struct Volume;

/// A rectangle-swept sphere: all points within `r` of the rectangle
/// { To + x axis.col(0) + y axis.col(1) : 0 <= x <= l[0], 0 <= y <= l[1] }.
template <typename S_>
struct Volume<fcl::RSS<S_>> {
  using S = S_;
  using BV = fcl::RSS<S>;
  using Point = fcl::Vector3<S>;

  static S radius(const BV& bv) { return bv.r; }
  static const fcl::Matrix3<S>& axes(const BV& bv) { return bv.axis; }
  static S smallestSide(const BV& bv) { return std::min(bv.l[0], bv.l[1]); }
  static Point center(const BV& bv) { return bv.center(); }
  /// The longest way through it.
  static S length(const BV& bv) { return bv.size(); }

  /// Moves the volume and lets it grow on all sides; rounded by at most epsilon times `cornerSum`
  /// of the result.
  static void move(BV& bv, const Point& translation, S growth) {
    for (int k = 0; k < 3; ++k) bv.To[k] += translation[k];  // by Eigen: through memory
    bv.r += growth;
  }
  /// Lets it grow or shrink on all sides, by the difference to its present radius.
  static void setRadius(BV& bv, S radius) { bv.r = radius; }
  /// To the next number above.
  static void raiseRadius(BV& bv) {
    bv.r = std::nextafter(bv.r, std::numeric_limits<S>::infinity());
  }
  /// Loads what `move` changes into the processor's cache.
  ADAPTIVE_BVH_INLINE static void prefetch(const BV& bv) {
    __builtin_prefetch(bv.To.data(), 1);
    __builtin_prefetch(&bv.r, 1);
  }
  /// Bounds |x| + |y| + |z| of the corner, the radius, and the sides.
  static S cornerSum(const BV& bv) { return bv.To.template lpNorm<1>() + bv.r + bv.l[0] + bv.l[1]; }
  /// Bounds |x| + |y| + |z| of every point of the volume.
  static S coordinateSum(const BV& bv) {
    return bv.To.template lpNorm<1>() + 2 * (bv.l[0] + bv.l[1] + bv.r);
  }

  /// The volume as all points within a radius of a parallelogram. Along a unit vector u it extends
  /// from `middle` as far as |u half[0]| + |u half[1]| + radius.
  struct SweptParallelogram {
    Point half[2];  ///< of its sides
    Point middle;
    S radius;
  };
  static SweptParallelogram parallelogram(const BV& bv) {
    const Point a = bv.axis.col(0) * (bv.l[0] / 2), b = bv.axis.col(1) * (bv.l[1] / 2);
    return {{a, b}, bv.To + a + b, bv.r};
  }

  /// A length that stands for the whole volume at a given radius: see InflationReference::NodeSize.
  static S size(const BV& bv, S radius) {
    const S length = radius + smallestSide(bv) / 2;
    return length > 0 ? length : std::max(bv.l[0], bv.l[1]);
  }

  /// The vector to p from a point of the rectangle, the nearest one up to rounding.
  static Point vectorFromRectangle(const BV& bv, const Point& p) {
    const Point v = p - bv.To;
    const S x = std::min(std::max(bv.axis.col(0).dot(v), S(0)), bv.l[0]);
    const S y = std::min(std::max(bv.axis.col(1).dot(v), S(0)), bv.l[1]);
    return v - bv.axis.col(0) * x - bv.axis.col(1) * y;
  }
  /// Distance from p to the rectangle, as computed; off by at most `containmentError`.
  static S distanceToRectangle(const BV& bv, const Point& p);

  /// Bound on the rounding error of `distanceToRectangle` when that returned `distance`.
  static S containmentError(const BV& bv, S distance);

  /// Whether p lies inside, or no farther outside than this computation rounds.
  static bool contains(const BV& bv, const Point& p);

  /// The numbers that make up a volume, for bitwise comparison.
  static constexpr int kNumbers = 15;
  static S& number(BV& bv, int i) {
    return i < 9 ? bv.axis.data()[i] : i < 12 ? bv.To[i - 9] : i < 14 ? bv.l[i - 12] : bv.r;
  }

  /// The smallest volume found that holds the `count` primitives listed; tight, not minimal. Every
  /// position lies inside in exact arithmetic. count >= 1. Allocates only while a thread's fits
  /// grow in size. `Primitive`: unsigned, a primitive's number, or the VertexIndices of one.
  template <typename Primitive>
  static BV fit(const MeshView<S>& mesh, const Primitive* primitives, int count);

  /// Whether a box is part of it.
  static constexpr bool kHasBox = false;

  /// \name Measures of tightness, in double precision
  /// \{
  static double volume(const BV& bv);
  static double surfaceArea(const BV& bv);
  /// The longer side of the box around the volume over the shorter, seen along the normal; 0 where
  /// the shorter one is 0.
  static double aspectRatio(const BV& bv);
  /// The share of `inner` that lies in `outer`, by 64 evenly spread sample points of the box around
  /// `inner`. Points on the surface count.
  static double shareWithin(const BV& inner, const BV& outer);
  /// \}
};

extern template struct Volume<fcl::RSS<float>>;
extern template struct Volume<fcl::RSS<double>>;

/// A box and a rectangle-swept sphere with the same axes around the same points. The box is
/// { obb.To + x axis.col(0) + y axis.col(1) + z axis.col(2) : |x|, |y|, |z| <= obb.extent }. FCL's
/// collisions test the box, its distances the swept sphere. What Volume<fcl::RSS<S>> says holds for
/// both; radius, size, shape and tightness are those of the swept sphere.
template <typename S_>
struct Volume<fcl::OBBRSS<S_>> {
  using S = S_;
  using BV = fcl::OBBRSS<S>;
  using Point = fcl::Vector3<S>;
  using RssPart = Volume<fcl::RSS<S>>;
  using SweptParallelogram = typename RssPart::SweptParallelogram;

  /// By how much the products of two axes may be off those of an orthonormal frame.
  static constexpr S kAxes = 32 * rounding::epsilon<S>();

  static S radius(const BV& bv) { return bv.rss.r; }
  static const fcl::Matrix3<S>& axes(const BV& bv) { return bv.rss.axis; }
  static S smallestSide(const BV& bv) { return RssPart::smallestSide(bv.rss); }
  static Point center(const BV& bv) { return RssPart::center(bv.rss); }
  static S length(const BV& bv) { return RssPart::length(bv.rss); }
  static S size(const BV& bv, S radius) { return RssPart::size(bv.rss, radius); }
  static SweptParallelogram parallelogram(const BV& bv) { return RssPart::parallelogram(bv.rss); }

  /// Along its axes the box grows by more than `growth`, for these may be too long and askew:
  /// docs/bounds.md, 12.
  static void move(BV& bv, const Point& translation, S growth) {
    RssPart::move(bv.rss, translation, growth);
    for (int k = 0; k < 3; ++k) bv.obb.To[k] += translation[k];
    bv.obb.extent.array() += growth * (1 + 4 * kAxes);
  }
  static void setRadius(BV& bv, S radius);
  static void raiseRadius(BV& bv) { RssPart::raiseRadius(bv.rss); }
  ADAPTIVE_BVH_INLINE static void prefetch(const BV& bv) {
    RssPart::prefetch(bv.rss);
    __builtin_prefetch(bv.obb.To.data(), 1);
    __builtin_prefetch(bv.obb.extent.data() + 2, 1);
  }

  /// The larger value of both parts; for the box that of its middle and its longest half side.
  static S cornerSum(const BV& bv) {
    return std::max(RssPart::cornerSum(bv.rss),
                    bv.obb.To.template lpNorm<1>() + bv.obb.extent.maxCoeff());
  }
  static S coordinateSum(const BV& bv) {
    return std::max(RssPart::coordinateSum(bv.rss),
                    bv.obb.To.template lpNorm<1>() + 2 * bv.obb.extent.sum());
  }

  static bool contains(const BV& bv, const Point& p);

  static constexpr int kNumbers = 2 * RssPart::kNumbers;
  static S& number(BV& bv, int i) {
    if (i < RssPart::kNumbers) return RssPart::number(bv.rss, i);
    i -= RssPart::kNumbers;
    return i < 9 ? bv.obb.axis.data()[i] : i < 12 ? bv.obb.To[i - 9] : bv.obb.extent[i - 12];
  }

  template <typename Primitive>
  static BV fit(const MeshView<S>& mesh, const Primitive* primitives, int count);
  static constexpr bool kHasBox = true;

  static double volume(const BV& bv) { return RssPart::volume(bv.rss); }
  static double surfaceArea(const BV& bv) { return RssPart::surfaceArea(bv.rss); }
  static double aspectRatio(const BV& bv) { return RssPart::aspectRatio(bv.rss); }
  static double shareWithin(const BV& inner, const BV& outer) {
    return RssPart::shareWithin(inner.rss, outer.rss);
  }
};

extern template struct Volume<fcl::OBBRSS<float>>;
extern template struct Volume<fcl::OBBRSS<double>>;

}  // namespace adaptive_bvh
