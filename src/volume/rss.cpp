#include "volume/rss.h"

#include <algorithm>

#include "volume/rss_fit.h"

namespace adaptive_bvh {

template <typename S>
S Volume<fcl::RSS<S>>::size(const BV& bv, S radius) {
  const S length = radius + std::min(bv.l[0], bv.l[1]) / 2;
  return length > 0 ? length : std::max(bv.l[0], bv.l[1]);
}

template <typename S>
S Volume<fcl::RSS<S>>::distanceToRectangle(const BV& bv, const Point& p) {
  return vectorFromRectangle(bv, p).norm();
}

// Any x in [0, l0] and y in [0, l1] name a point q of the rectangle, so |p - q| bounds the distance
// whatever the rounding of x and y. Let w = p - To - a0 x - a1 y exactly. A component of the
// computed w is off by at most 3u (|v_i| + |a0_i x| + |a1_i y|), hence the vector by
// 3u (|v| + 1.01 (x + y)) <= 3u |w| + 6.1u (l0 + l1), with |v| <= |w| + 1.01 (x + y) and axes of
// length at most 1.01. The norm adds 3u and underflow adds tiny. So the exact distance is at most
// d (1 + 6u) + 6.2u (l0 + l1) + tiny; the bound below is twice that, which also covers its own
// evaluation, the caller's sum, and a distance taken as the upper end.
template <typename S>
S Volume<fcl::RSS<S>>::containmentError(const BV& bv, S distance) {
  return 6 * rounding::epsilon<S>() * (distance + bv.l[0] + bv.l[1]) + rounding::tiny<S>();
}

template <typename S>
fcl::RSS<S> Volume<fcl::RSS<S>>::fit(const MeshView<S>& mesh, const unsigned* primitives,
                                     int count) {
  return fitRss(mesh, primitives, count);
}

template <typename S>
fcl::RSS<S> Volume<fcl::RSS<S>>::fit(const MeshView<S>& mesh, const Corners* primitives,
                                     int count) {
  return fitRss(mesh, primitives, count);
}

template struct Volume<fcl::RSS<float>>;
template struct Volume<fcl::RSS<double>>;

}  // namespace adaptive_bvh
