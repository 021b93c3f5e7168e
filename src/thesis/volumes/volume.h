#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/math/bv/OBBRSS.h>
#include <fcl/math/bv/RSS.h>

#include "base/pack.h"
#include "base/rounding.h"
#include "mesh/mesh_view.h"

/// Calls a macro with every type of bounding volume that the library supports, for explicit
/// instantiation.
#define ADAPTIVE_BVH_FOR_EACH_VOLUME(macro) \
  macro(fcl::RSSf) macro(fcl::OBBRSSf) ADAPTIVE_BVH_FOR_EACH_DOUBLE_VOLUME(macro)
/// Those of models that queries of the library take.
#define ADAPTIVE_BVH_FOR_EACH_DOUBLE_VOLUME(macro) macro(fcl::RSSd) macro(fcl::OBBRSSd)

namespace adaptive_bvh {

/// The operations on one type of bounding volume. All other code uses only these, so a new type is
/// a new specialization.
template <typename BV>
struct Volume;

/// A rectangle-swept sphere: all points within `r` of the rectangle { To + x axis.col(0) + y
/// axis.col(1) : 0 <= x <= l[0], 0 <= y <= l[1] }.
template <typename S_>
struct Volume<fcl::RSS<S_>> {
  using S = S_;
  using BV = fcl::RSS<S>;
  using Point = fcl::Vector3<S>;

  static S radius(const BV& bv) { return bv.r; }
  /// A matrix whose columns are the axes; the third is the rectangle's normal.
  static const fcl::Matrix3<S>& axes(const BV& bv) { return bv.axis; }
  /// The shorter side of the rectangle.
  static S smallestSide(const BV& bv) { return std::min(bv.l[0], bv.l[1]); }
  static Point center(const BV& bv) { return bv.center(); }
  static S length(const BV& bv) { return bv.size(); }  ///< the diameter of the volume

  /// Translates the volume and enlarges it on all sides; the rounding error is at most epsilon
  /// times `cornerSum` of the result.
  static void move(BV& bv, const Point& translation, S growth) {
    for (int k = 0; k < 3; ++k) bv.To[k] += translation[k];  // Eigen would go through memory
    bv.r += growth;
  }
  /// Enlarges or shrinks the volume on all sides, to a new radius.
  static void setRadius(BV& bv, S radius) { bv.r = radius; }
  /// Increases the radius to the next floating-point number.
  static void raiseRadius(BV& bv) {
    bv.r = std::nextafter(bv.r, std::numeric_limits<S>::infinity());
  }
  /// Prefetches the data that `move` changes.
  ADAPTIVE_BVH_INLINE static void prefetch(const BV& bv) {
    __builtin_prefetch(bv.To.data(), 1);
    __builtin_prefetch(&bv.r, 1);
  }
  /// |x| + |y| + |z| of the rectangle's corner To, plus the radius and both sides. Rounding errors
  /// of moving the volume are proportional to it.
  static S cornerSum(const BV& bv) { return bv.To.template lpNorm<1>() + bv.r + bv.l[0] + bv.l[1]; }
  /// An upper bound of |x| + |y| + |z| over all points of the volume.
  static S coordinateSum(const BV& bv) {
    return bv.To.template lpNorm<1>() + 2 * (bv.l[0] + bv.l[1] + bv.r);
  }

  /// The volume as the set of points within a radius of a parallelogram. Along a unit vector u it
  /// extends |u half[0]| + |u half[1]| + radius from `middle`.
  struct SweptParallelogram {
    Point half[2];  ///< half of the vectors along its sides
    Point middle;
    S radius;
  };
  static SweptParallelogram parallelogram(const BV& bv) {
    const Point a = bv.axis.col(0) * (bv.l[0] / 2), b = bv.axis.col(1) * (bv.l[1] / 2);
    return {{a, b}, bv.To + a + b, bv.r};
  }

  /// The reference length of a volume with a given radius: see InflationReference::NodeSize.
  static S size(const BV& bv, S radius) {
    const S length = radius + smallestSide(bv) / 2;
    return length > 0 ? length : std::max(bv.l[0], bv.l[1]);
  }

  /// The vector to p from the nearest point of the rectangle, up to rounding.
  static Point vectorFromRectangle(const BV& bv, const Point& p) {
    const Point v = p - bv.To;
    const S x = std::min(std::max(bv.axis.col(0).dot(v), S(0)), bv.l[0]);
    const S y = std::min(std::max(bv.axis.col(1).dot(v), S(0)), bv.l[1]);
    return v - bv.axis.col(0) * x - bv.axis.col(1) * y;
  }
  /// The distance from p to the rectangle; its rounding error is at most `containmentError`.
  static S distanceToRectangle(const BV& bv, const Point& p);

  /// A bound on the rounding error of `distanceToRectangle` when it returned `distance`.
  static S containmentError(const BV& bv, S distance);

  /// Whether p is inside, or outside by no more than the rounding error.
  static bool contains(const BV& bv, const Point& p);

  /// The numbers that make up a volume, for bitwise comparison.
  static constexpr int kNumbers = 15;
  static S& number(BV& bv, int i) {
    return i < 9 ? bv.axis.data()[i] : i < 12 ? bv.To[i - 9] : i < 14 ? bv.l[i - 12] : bv.r;
  }

  /// Fits a volume to `count` >= 1 primitives; tight, but not minimal. It encloses every position
  /// in exact arithmetic. Allocates only when a thread's fits grow in size. `Primitive` is
  /// unsigned (a primitive's index in the mesh) or VertexIndices (the primitive's vertices).
  template <typename Primitive>
  static BV fit(const MeshView<S>& mesh, const Primitive* primitives, int count);

  static constexpr bool kHasBox = false;  ///< whether the type of volume also stores a box

  /// \name Measures of tightness, in double precision
  /// \{
  static double volume(const BV& bv);
  static double surfaceArea(const BV& bv);
  /// The ratio of the longer to the shorter side of the volume's bounding rectangle, seen along the
  /// normal; 0 if the shorter side is 0.
  static double aspectRatio(const BV& bv);
  /// The share of `inner` that lies in `outer`, estimated with 64 evenly spread sample points in
  /// the box around `inner`. Points on the surface count as inside.
  static double shareWithin(const BV& inner, const BV& outer);
  /// \}
};

extern template struct Volume<fcl::RSS<float>>;
extern template struct Volume<fcl::RSS<double>>;

/// A box and a rectangle-swept sphere with the same axes around the same points. The box is {
/// obb.To + x axis.col(0) + y axis.col(1) + z axis.col(2) : |x|, |y|, |z| <= obb.extent }. FCL's
/// collision tests use the box, its distances the swept sphere. The comments of Volume<fcl::RSS<S>>
/// apply to both; radius, size, shape and tightness are those of the swept sphere.
template <typename S_>
struct Volume<fcl::OBBRSS<S_>> {
  using S = S_;
  using BV = fcl::OBBRSS<S>;
  using Point = fcl::Vector3<S>;
  using RssPart = Volume<fcl::RSS<S>>;
  using SweptParallelogram = typename RssPart::SweptParallelogram;

  /// The largest deviation of the axes' dot products from those of an orthonormal frame.
  static constexpr S kAxes = 32 * rounding::epsilon<S>();

  static S radius(const BV& bv) { return bv.rss.r; }
  static const fcl::Matrix3<S>& axes(const BV& bv) { return bv.rss.axis; }
  static S smallestSide(const BV& bv) { return RssPart::smallestSide(bv.rss); }
  static Point center(const BV& bv) { return RssPart::center(bv.rss); }
  static S length(const BV& bv) { return RssPart::length(bv.rss); }
  static S size(const BV& bv, S radius) { return RssPart::size(bv.rss, radius); }
  static SweptParallelogram parallelogram(const BV& bv) { return RssPart::parallelogram(bv.rss); }

  /// Enlarges the box by more than `growth` along its axes, because these may be too long or not
  /// orthogonal: docs/bounds.md, 12.
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

  /// The larger value of both parts; for the box, that of its centre and its longest half side.
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
