#pragma once

#include <fcl/math/bv/RSS.h>

#include "volume/mesh_view.h"
#include "volume/rounding.h"

namespace adaptive_bvh {

/// What is special to one type of bounding volume. The floors above use only this.
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
  static S& radius(BV& bv) { return bv.r; }
  static const fcl::Matrix3<S>& axes(const BV& bv) { return bv.axis; }

  /// The three coordinates that fix the volume in space. Adding to them moves it, rounded by at
  /// most epsilon times `reach` of the result.
  static S* corner(BV& bv) { return bv.To.data(); }
  static S reach(const BV& bv) { return bv.To.template lpNorm<1>() + bv.r; }

  /// A length that stands for the whole volume at a given radius: see InflationReference::NodeSize.
  static S size(const BV& bv, S radius);

  /// Distance from p to the rectangle, as computed; off by at most `containmentError`.
  static S distanceToRectangle(const BV& bv, const Point& p);

  /// Bound on the rounding error of `distanceToRectangle` when that returned `distance`.
  static S containmentError(const BV& bv, S distance);

  /// The numbers that make up a volume, for bitwise comparison.
  static constexpr int kNumbers = 15;
  static S& number(BV& bv, int i) {
    return i < 9 ? bv.axis.data()[i] : i < 12 ? bv.To[i - 9] : i < 14 ? bv.l[i - 12] : bv.r;
  }

  /// The smallest volume found that holds the `count` primitives listed; tight, not minimal. Every
  /// position lies inside in exact arithmetic. count >= 1. Allocates only while a thread's fits
  /// grow in size.
  static BV fit(const MeshView<S>& mesh, const unsigned* primitives, int count);
  /// The same of primitives that are given by their vertices.
  static BV fit(const MeshView<S>& mesh, const Corners* primitives, int count);
};

extern template struct Volume<fcl::RSS<float>>;
extern template struct Volume<fcl::RSS<double>>;

}  // namespace adaptive_bvh
