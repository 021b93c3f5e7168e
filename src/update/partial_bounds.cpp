#include "update/partial_bounds.h"

#include <cmath>
#include <type_traits>
#include <utility>

#include <fcl/math/bv/RSS.h>

#include "geometry/rounding.h"
#include "update/local_bounds.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// The largest value of a `Measure` over all vertices of triangles. A measure has value(point), and
/// bound(box), which is at least the value of every point in the box. Searches the box tree, the
/// child with the larger bound first, and skips nodes whose bound is not above the largest value
/// found.
template <typename BV, typename Measure>
class LargestSearch {
 public:
  using S = typename BV::S;

  LargestSearch(const fcl::BVHModel<BV>& model, const Topology& topology, const BoxTree<S>& boxes,
                const Measure& measure)
      : model_(model),
        topology_(topology),
        boxes_(boxes.nodes()),
        measure_(measure),
        steps_left_(model.num_vertices / 8 + 64) {}

  /// The largest one, or `known` when none is larger. False when walking over all vertices is
  /// likely to be faster.
  bool run(S known, S& largest) {
    largest_ = known;
    if (!visit(0)) return false;
    largest = largest_;
    return true;
  }

 private:
  bool visit(int node) {
    if (boxes_.isLeaf(node)) {
      for (unsigned v :
           topology_.slots.verticesOf(static_cast<std::size_t>(boxes_.leafIndex(node))))
        largest_ = std::max(largest_, measure_.value(model_.vertices[v]));
      return true;
    }
    if (--steps_left_ < 0) return false;
    int first = boxes_.left(node), second = first + 1;
    S first_bound = measure_.bound(boxes_.box(first));
    S second_bound = measure_.bound(boxes_.box(second));
    if (first_bound < second_bound) {
      std::swap(first, second);
      std::swap(first_bound, second_bound);
    }
    return (first_bound <= largest_ || visit(first)) && (second_bound <= largest_ || visit(second));
  }

  const fcl::BVHModel<BV>& model_;
  const Topology& topology_;
  const BoxNodes<const BoxNode> boxes_;
  const Measure& measure_;
  int steps_left_;
  S largest_ = 0;
};

/// Bounds the error of a length, or of a coordinate along a direction, that is computed in body
/// coordinates from points whose coordinates are at most `extent`. The points are off by kError of
/// `extent` in each component, sqrt(3) of that as a vector; the arithmetic, in single precision,
/// adds less than a quarter of that.
template <typename S>
S errorInBoxes(const BoxTree<S>& boxes, float extent) {
  const S length = S(extent) * boxes.frame.unit();
  return 4 * S(BodyFrame<S>::kError) * length +
         8 * rounding::epsilon<S>() * (boxes.frame.origin().template lpNorm<1>() + length) +
         rounding::tiny<S>();
}

/// Measure: a coordinate, or its opposite.
template <typename S>
class Coordinate {
 public:
  Coordinate(const BoxTree<S>& boxes, int axis, int sign)
      : axis_(axis),
        sign_(S(sign)),
        unit_(boxes.frame.unit()),
        base_(sign_ * boxes.frame.origin()[axis] +
              errorInBoxes(boxes, boxes.root().largestCoordinate())) {
    for (int k = 0; k < 3; ++k) direction_[k] = float(sign * boxes.frame.axes()(axis, k));
  }

  S value(const fcl::Vector3<S>& p) const { return sign_ * p[axis_]; }
  /// Each end of each side gives the largest product, by its direction's sign.
  S bound(const Box& box) const {
    return base_ +
           unit_ * S(float4::sum(float4::upper(direction_ * box.low, direction_ * box.high)));
  }

 private:
  int axis_;
  S sign_, unit_, base_;
  Float4 direction_{0, 0, 0, 0};
};

/// Measure: the squared distance from a centre.
template <typename S>
class SquaredDistance {
 public:
  SquaredDistance(const BoxTree<S>& boxes, const fcl::Vector3<S>& center)
      : center_(center),
        placed_(boxes.frame.toBodyFrame(center)),
        unit_(boxes.frame.unit()),
        error_(errorInBoxes(boxes, boxes.root().largestCoordinate() +
                                       float4::largest(float4::absolute(placed_)))) {}

  S value(const fcl::Vector3<S>& p) const { return (p - center_).squaredNorm(); }
  S bound(const Box& box) const {
    const Float4 far = float4::upper(placed_ - box.low, box.high - placed_);
    const S distance = unit_ * std::sqrt(S(float4::sum(far * far))) + error_;
    return distance * distance * (1 + 8 * rounding::epsilon<S>());
  }

 private:
  fcl::Vector3<S> center_;
  Float4 placed_;
  S unit_, error_;
};

}  // namespace

template <typename BV>
void PartialBounds<BV>::finish(const Topology& topology, const BoxTree<S>& boxes,
                               bool in_triangles) {
  const Point center = model_.aabb_center;
  const auto search = [&](const auto& measure, S known, S& largest) {
    return in_triangles &&
           LargestSearch<BV, std::decay_t<decltype(measure)>>(model_, topology, boxes, measure)
               .run(known, largest);
  };
  // A side that no vertex left stays, or moves out to a vertex that moved beyond it. So does a side
  // that was left, when some vertex is now beyond where it was. Else it must be searched.
  const auto settle = [&](const Sides& sides, int sign, Point& side) {
    for (int k = 0; k < 3; ++k) {
      const S old = sign * side[k];
      S now = std::max(old, sides.found[k]);
      if (sides.left[k] && sides.found[k] < old &&
          !search(Coordinate<S>(boxes, k, sign), sides.found[k], now))
        return false;
      side[k] = sign * now;
    }
    return true;
  };
  Point low = model_.aabb_local.min_, high = model_.aabb_local.max_;
  if (!settle(low_, -1, low) || !settle(high_, 1, high)) return updateLocalBounds(model_);
  setLocalBox(model_, low, high);

  const bool moved = model_.aabb_center != center;
  const S old = model_.aabb_radius * model_.aabb_radius;
  S squared = farthest_;
  if (moved || (left_radius_ && farthest_ < old * (1 + kSlack))) {
    if (!search(SquaredDistance<S>(boxes, model_.aabb_center), moved ? S(0) : farthest_, squared))
      squared = squaredRadius(model_);
  } else if (farthest_ <= old) {
    return;
  }
  model_.aabb_radius = std::sqrt(squared);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class PartialBounds<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
