#include "volume/extents.h"

#include <algorithm>

#include "volume/swept_fit.h"

namespace adaptive_bvh {
namespace {

using P = Pack<float>;
constexpr std::size_t kPack = packs::kSize<float>;

/// How far beyond the nearer end of a side; negative inside.
ADAPTIVE_BVH_INLINE P beyond(const Interval<float>& side, const P& p) {
  return packs::upper<P>(side.low - p, p - side.high);
}

/// The rectangle that needs no corners, then whether a point lies beyond one.
class SlabFit {
 public:
  SlabFit(const LocalPoints<float>& points, const Slab<float>& slab)
      : points_(points), slab_(slab), rectangle_(rectangleWithoutCorners(points, slab)) {
    if (!measure()) return;
    growCorners(rectangle_, points_, slab_);
    measure();
  }

  Extents extents() const {
    return {{rectangle_.x.low, rectangle_.y.low, slab_.middle},
            {rectangle_.x.length(), rectangle_.y.length()},
            std::sqrt(squared_)};
  }

 private:
  /// Finds the radius. Returns whether some point lies beyond two sides and out of the sphere.
  bool measure() {
    P farthest{};
    bool corners = false;
    for (std::size_t i = 0; i < points_.size(); i += kPack) {
      const P x = packs::upper(beyond(rectangle_.x, points_.pack(0, i)), P{}),
              y = packs::upper(beyond(rectangle_.y, points_.pack(1, i)), P{}),
              z = points_.pack(2, i) - slab_.middle;
      const P plane = x * x + y * y;
      corners |=
          packs::any((x > 0) & (y > 0) & (plane > slab_.squaredHalfChord(points_.pack(2, i))));
      farthest = packs::upper<P>(farthest, plane + z * z);
    }
    squared_ = packs::largest(farthest);
    return corners;
  }

  const LocalPoints<float>& points_;
  const Slab<float> slab_;
  Rectangle<float> rectangle_;
  float squared_ = 0;
};

/// The sphere for some points whose heights are `z`, and what it gives. One of half the thickness
/// is the least that will do, but not always the best: over a dome, a larger one lets the rectangle
/// end far within the rim.
Extents bestSphere(const LocalPoints<float>& points, const Interval<float>& z, Slab<float>& slab) {
  const float half = z.length() / 2;
  const Slab<float> least{(z.low + z.high) / 2, half};
  slab = least;
  Extents best = SlabFit(points, slab).extents();
  if (!(half > 0.1f * (best.sides[0] + best.sides[1]))) return best;
  for (float shift : {-half / 2, half / 2}) {
    const Slab<float> larger{least.middle + shift, 1.5f * half};
    const Extents other = SlabFit(points, larger).extents();
    if (!(other.area() < best.area())) continue;
    best = other;
    slab = larger;
  }
  return best;
}

}  // namespace

Extents extentsOf(const LocalPoints<float>& points, const Interval<float>& z,
                  LocalPoints<float>& few) {
  Slab<float> slab;
  if (&judges(points, few) == &points) return bestSphere(points, z, slab);
  bestSphere(few, heights(few), slab);
  slab.radius = std::max({slab.radius, z.high - slab.middle, slab.middle - z.low});
  return SlabFit(points, slab).extents();
}

}  // namespace adaptive_bvh
