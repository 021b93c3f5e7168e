// Volume: containment and measures. Fits are in volume_fit.cpp.
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {

template <typename S>
S Volume<fcl::RSS<S>>::distanceToRectangle(const BV& bv, const Point& p) {
  return vectorFromRectangle(bv, p).norm();
}

// Let a0, a1 be the axes, l0, l1 the sides, v = p - To, u the unit roundoff. For any x in [0, l0]
// and y in [0, l1], q = To + a0 x + a1 y is a point of the rectangle, so |p - q| bounds the
// distance whatever the rounding of x and y. Let w = p - q exactly. The error of a component of the
// computed w is at most 3u (|v_i| + |a0_i x| + |a1_i y|), hence the vector's at most 3u (|v| + 1.01
// (x + y))
// <= 3u |w| + 6.1u (l0 + l1), with |v| <= |w| + 1.01 (x + y) and axes of length at most 1.01. The
// norm adds 3u and underflow adds tiny. So the exact distance is at most d (1 + 6u) + 6.2u (l0 +
// l1) + tiny, where d is the computed one. The error bound below (epsilon = 2u) is twice the
// difference, which also covers its own evaluation and the caller's sum.
template <typename S>
S Volume<fcl::RSS<S>>::containmentError(const BV& bv, S distance) {
  return 6 * rounding::epsilon<S>() * (distance + bv.l[0] + bv.l[1]) + rounding::tiny<S>();
}

template <typename S>
bool Volume<fcl::RSS<S>>::contains(const BV& bv, const Point& p) {
  const S distance = distanceToRectangle(bv, p);
  return distance <= bv.r + containmentError(bv, distance);
}

// Steiner's formula for the points within r of an a x b rectangle.
template <typename S>
double Volume<fcl::RSS<S>>::volume(const BV& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return a * b * 2 * r + M_PI * r * r * (a + b) + 4. / 3 * M_PI * r * r * r;
}

// The derivative of the volume by r.
template <typename S>
double Volume<fcl::RSS<S>>::surfaceArea(const BV& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return 2 * a * b + 2 * M_PI * r * (a + b) + 4 * M_PI * r * r;
}

template <typename S>
double Volume<fcl::RSS<S>>::aspectRatio(const BV& bv) {
  const double a = bv.l[0] + 2 * bv.r, b = bv.l[1] + 2 * bv.r;
  return std::min(a, b) > 0 ? std::max(a, b) / std::min(a, b) : 0;
}

// The sample points are the first 64 of the additive recurrence with the powers of 1/g, g^4 = g + 1
// (Roberts 2018), which fills a box evenly for any number of points.
template <typename S>
double Volume<fcl::RSS<S>>::shareWithin(const BV& inner, const BV& outer) {
  constexpr int kSamples = 64;
  constexpr double kStep[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  const S slack = S(1e-6) * (outer.r + outer.l[0] + outer.l[1]);  // coplanar points count as inside
  int within = 0;
  for (int i = 0; i < kSamples; ++i) {
    double sample[3];  // in the unit cube
    for (int k = 0; k < 3; ++k) sample[k] = std::fmod(0.5 + kStep[k] * (i + 1), 1.);
    const Point p = inner.To + inner.axis.col(0) * (S(sample[0]) * inner.l[0]) +
                    inner.axis.col(1) * (S(sample[1]) * inner.l[1]) +
                    inner.axis.col(2) * (S(2 * sample[2] - 1) * inner.r);
    within += distanceToRectangle(outer, p) <= outer.r + slack;
  }
  return within / double(kSamples);
}

// Rounding of the box: docs/bounds.md, 12.
template <typename S>
void Volume<fcl::OBBRSS<S>>::setRadius(BV& bv, S radius) {
  const S growth = radius - bv.rss.r;
  const S extent_growth = growth > 0 ? growth * (1 + 4 * kAxes) : growth;  // as in `move`
  constexpr S kRounding = 2 * rounding::epsilon<S>();
  bv.obb.extent =
      (bv.obb.extent.array() + extent_growth) * (1 + kRounding) + kRounding * (radius + bv.rss.r);
  RssPart::setRadius(bv.rss, radius);
}

template <typename S>
bool Volume<fcl::OBBRSS<S>>::contains(const BV& bv, const Point& p) {
  const Point distances = (bv.obb.axis.transpose() * (p - bv.obb.To)).cwiseAbs();  // along the axes
  const S error = 3 * rounding::epsilon<S>() * distances.sum() + rounding::tiny<S>();
  return ((distances - bv.obb.extent).array() <= error).all() && RssPart::contains(bv.rss, p);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template struct Volume<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
