#include "update/body_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "update/triangle_volumes.h"
#include "volume/each_volume.h"
#include "volume/swept_fit.h"

namespace adaptive_bvh {
namespace {

struct WorkSpace {
  PointArrays<float> points, few, local;
};
WorkSpace& workSpace() {
  static thread_local WorkSpace space;
  return space;
}

/// Some points along axes, from the first of them; returns how far they extend along the third, and
/// along the others where `kWithBox`. load(i) is the i-th point.
template <bool kWithBox, typename Load>
ADAPTIVE_BVH_INLINE Ranges turn(std::size_t count, const Axes4& axes, PointArrays<float>& turned,
                                Load&& load) {
  turned.resize(count);
  const Float4 first = load(0);
  Extent<float> first_axis, second_axis, heights;
  const auto put = [&](std::size_t i, const float4::Columns& points) {
    const Float4 x = points.x - first[0], y = points.y - first[1], z = points.z - first[2];
    const auto along = [&](const Float4& axis) -> Float4 {
      return x * float4::all(axis[0]) + y * float4::all(axis[1]) + z * float4::all(axis[2]);
    };
    const Float4 a = along(axes.x), b = along(axes.y), height = along(axes.z);
    turned.setPack(i, a, b, height);
    heights.add(height);
    if constexpr (kWithBox) {
      first_axis.add(a);
      second_axis.add(b);
    }
  };
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4)
    put(i, float4::columns(load(i), load(i + 1), load(i + 2), load(i + 3)));
  if (i < count)
    put(i, float4::columns(load(i), i + 1 < count ? load(i + 1) : first,
                           i + 2 < count ? load(i + 2) : first, first));
  return {first_axis.interval(), second_axis.interval(), heights.interval()};
}

template <typename Matrix>
Axes4 columnsOf(const Matrix& axes) {
  const auto column = [&](int k) -> Float4 {
    return Float4{float(axes(0, k)), float(axes(1, k)), float(axes(2, k)), 0};
  };
  return {column(0), column(1), column(2)};
}

}  // namespace

template <typename BV>
BodyFit<BV>::BodyFit(const UpdateTarget<BV>& target, const VertexState* states,
                     const std::array<float, 4>* previous, KeptAxes* kept,
                     const RefitPolicy& policy)
    : target_(target),
      slots_(target.tree.topology.slots),
      states_(states),
      previous_(previous),
      kept_(kept),
      limit_(1 + static_cast<float>(policy.axes_tolerance)),
      frame_(target.tree.boxes->frame),
      in_model_(frame_, target.tree.boxes->root().largestCoordinate()),
      points_(workSpace().points),
      few_(workSpace().few) {}

template <typename BV>
BV BodyFit<BV>::operator()(int node) {
  BV bv;
  BV* const to = &bv;
  (*this)(&node, &to, 1);
  return bv;
}

/// Triangles by four; the volumes of other nodes are taken to the model by four.
template <typename BV>
void BodyFit<BV>::operator()(const int* nodes, BV* const* to, int count) {
  BodyVolume triangles[kLanes], others[kLanes];
  BV *triangles_to[kLanes], *others_to[kLanes];
  std::size_t leaves[kLanes] = {};
  int triangle = 0, other = 0;
  const auto finishTriangles = [&] {
    fitTriangles(leaves, triangles);
    in_model_.write(triangles, triangles_to, std::exchange(triangle, 0));
  };
  for (int i = 0; i < count; ++i) {
    if (isTriangle(nodes[i])) {
      leaves[triangle] = static_cast<std::size_t>(target_.model.getBV(nodes[i]).first_primitive);
      triangles_to[triangle] = to[i];
      if (++triangle == kLanes) finishTriangles();
    } else {
      others[other] = fit(nodes[i]);
      others_to[other] = to[i];
      if (++other == kLanes) in_model_.write(others, others_to, std::exchange(other, 0));
    }
  }
  if (triangle > 0) finishTriangles();
  if (other > 0) in_model_.write(others, others_to, other);
}

template <typename BV>
void BodyFit<BV>::fitTriangles(const std::size_t (&leaves)[kLanes],
                               BodyVolume (&volumes)[kLanes]) const {
  VertexIndices slots[kLanes];
  for (int i = 0; i < kLanes; ++i) slots[i] = slots_.slotsOf(leaves[i]);
  const auto corners = [&](int k) -> float4::Columns {
    return float4::columns(at(slots[0][k]), at(slots[1][k]), at(slots[2][k]), at(slots[3][k]));
  };
  adaptive_bvh::fitTriangles({corners(0), corners(1), corners(2)}, volumes);
}

template <typename BV>
BodyVolume BodyFit<BV>::fit(int node) {
  const fcl::BVNode<BV>& fcl_node = target_.model.getBV(node);
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  const auto count = static_cast<std::size_t>(fcl_node.num_primitives);
  if (count == 2) return fitPair(first);
  if (count == 1) {  // in two frames
    const VertexSlots::Set below = slots_.below(first, count);
    return fitAlong(bestAxesOf(below), below);
  }
  KeptAxes& kept = kept_[target_.tree.boxes->nodes().largeIndex(node)];
  const VertexSlots::Set below = slots_.below(first, count, kept.slots);
  const Axes4 frame = nodeFrame(first, count);
  Axes4 axes = frame * kept.rotation.axes();
  Extents extents = extentsAlong(axes, below);
  if (!(extents.area() <= limit_ * kept.area)) {
    const Axes4 anew = bestAxesOf(below);
    const Extents other = extentsAlong(anew, below);
    if (other.area() < extents.area()) {
      axes = anew;
      extents = other;
      kept.rotation = PackedRotation(frame.components(axes));
    }
    kept.area = extents.area();
  }
  return volumeAlong(axes, extents);
}

template <typename BV>
void BodyFit<BV>::keepAxes(int node, const BV& bv) {
  const fcl::BVNode<BV>& fcl_node = target_.model.getBV(node);
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  const auto count = static_cast<std::size_t>(fcl_node.num_primitives);
  const Axes4 frame = nodeFrame(first, count);
  const fcl::Matrix3d in_body =
      frame_.axes().transpose() * Volume<BV>::axes(bv).template cast<double>();
  const Axes4 axes = columnsOf(in_body);
  const auto scale = static_cast<double>(frame_.scale());
  kept_[target_.tree.boxes->nodes().largeIndex(node)] = {
      slots_.below(first, count).bits, PackedRotation(frame.components(axes)),
      static_cast<float>(Volume<BV>::surfaceArea(bv) * scale * scale)};
}

/// Two triangles with a common edge are four points: of all pairs of planes between which they lie,
/// those through the diagonals are nearest. In them, the least rectangle has a side along one of
/// the outer edges. No sphere of half their distance lets the rectangle end within the points.
template <typename BV>
BodyVolume BodyFit<BV>::fitPair(std::size_t leaf) {
  const VertexIndices s = slots_.slotsOf(leaf), t = slots_.slotsOf(leaf + 1);
  const auto has = [](const VertexIndices& of, unsigned v) {
    return (of[0] == v) + (of[1] == v) + (of[2] == v);
  };
  const int in_t[3] = {has(t, s[0]), has(t, s[1]), has(t, s[2])};
  const int i = !in_t[0] ? 0 : !in_t[1] ? 1 : 2, j = !has(s, t[0]) ? 0 : !has(s, t[1]) ? 1 : 2;
  const unsigned ends[2] = {s[std::size_t(i < 2 ? i + 1 : 0)], s[std::size_t(i > 0 ? i - 1 : 2)]};
  // A triangle may name a vertex twice.
  const bool is_quad =
      in_t[0] + in_t[1] + in_t[2] == 2 && ends[0] != ends[1] && !has(s, t[std::size_t(j)]);
  const VertexSlots::Set below = slots_.below(leaf, 2);
  if (!is_quad || previous_) return fitAlong(bestAxesOf(below), below);

  const Float4 a = at(ends[0]), b = at(ends[1]), c = at(s[std::size_t(i)]),
               d = at(t[std::size_t(j)]);
  const Axes4 axes = axesAlong(b - a, d - c);
  // Around: a, c, b, d, a lane for each, and the next of each.
  const Float4 none = float4::all(0);
  const float4::Columns around = float4::columns(none, c - a, b - a, d - a);
  const auto along = [&](const Float4& axis) -> Float4 {
    return around.x * axis[0] + around.y * axis[1] + around.z * axis[2];
  };
  const Float4 x = along(axes.x), y = along(axes.y), z = along(axes.z);
  const Float4 dx = Float4{x[1], x[2], x[3], x[0]} - x, dy = Float4{y[1], y[2], y[3], y[0]} - y;
  Float4 low_x = none, high_x = none, low_y = none, high_y = none;  // of a
  for (int k = 1; k < 4; ++k) {  // along all four edges, times their lengths
    const Float4 forth = dx * x[k] + dy * y[k], across = dx * y[k] - dy * x[k];
    low_x = float4::lower(low_x, forth);
    high_x = float4::upper(high_x, forth);
    low_y = float4::lower(low_y, across);
    high_y = float4::upper(high_y, across);
  }
  constexpr float kTiny = 1e-30f;
  const Float4 squares = float4::upper(dx * dx + dy * dy, float4::all(kTiny));
  const Float4 areas = (high_x - low_x) * (high_y - low_y) / squares;
  int best = 0;
  for (int k = 1; k < 4; ++k)
    if (areas[k] < areas[best] && squares[k] > kTiny) best = k;
  if (!(squares[best] > kTiny)) return fitAlong(axes, below);
  const float scale = 1 / std::sqrt(squares[best]);
  const Axes4 turned = axes.turned(dx[best] * scale, dy[best] * scale);
  const Ranges ranges{{low_x[best] * scale, high_x[best] * scale},
                      {low_y[best] * scale, high_y[best] * scale},
                      {packs::smallest(z), packs::largest(z)}};
  const float half = ranges.z.length() / 2, sides[2] = {ranges.x.length(), ranges.y.length()};
  if (half > 0.1f * (sides[0] + sides[1])) return fitAlong(turned, below);
  first_ = a;
  return volumeAlong(turned, {{ranges.x.low, ranges.y.low, (ranges.z.low + ranges.z.high) / 2},
                              {sides[0], sides[1]},
                              half,
                              ranges});
}

template <typename BV>
Axes4 BodyFit<BV>::bestAxesOf(const VertexSlots::Set& below) {
  turnPoints<false>(below, Axes4());
  const Axes4 axes = columnsOf(bestAxes(points_, few_, workSpace().local));
  return axesAlong(axes.x, axes.y);  // orthonormal as all other axes are
}

/// A frame that turns as the node's vertices do: spanned by three of them, far apart; where these
/// lie nearly on a line, by two of them and a triangle.
template <typename BV>
Axes4 BodyFit<BV>::nodeFrame(std::size_t first, std::size_t count) const {
  const VertexIndices middle = slots_.slotsOf(first + count / 2);
  const Float4 p = at(slots_.slotsOf(first)[0]), q = at(middle[1]);
  const Float4 along = at(slots_.slotsOf(first + count - 1)[2]) - p, aside = q - p;
  const Float4 normal = float4::cross(along, aside);
  const Float4 squares = float4::sums(normal * normal, along * along, aside * aside, aside * aside);
  constexpr float kOnALine = 0.02f;
  if (squares[0] > kOnALine * squares[1] * squares[2]) return axesAlong(along, aside);
  return axesAlong(along, float4::cross(at(middle[0]) - q, at(middle[2]) - q));
}

template <typename BV>
template <bool kWithBox>
Ranges BodyFit<BV>::turnPoints(const VertexSlots::Set& below, const Axes4& axes) {
  const VertexState* const states = states_ + below.first;
  const auto two_frames = [&](std::size_t count, auto&& slot) {
    const std::array<float, 4>* const previous = previous_ + below.first;
    return turn<kWithBox>(2 * count, axes, points_, [&](std::size_t i) -> Float4 {
      return float4::load(i < count ? states[slot(i)].position : previous[slot(i - count)].data());
    });
  };
  if (below.bits == 0) {
    const std::size_t count = below.last - below.first;
    first_ = float4::load(states[0].position);
    if (previous_) return two_frames(count, [](std::size_t i) { return i; });
    return turn<kWithBox>(count, axes, points_, [&](std::size_t i) -> Float4 {
      return float4::load(states[i].position);
    });
  }
  std::uint8_t offsets[VertexSlots::kBlock];
  std::size_t count = 0;
  for (std::uint64_t bits = below.bits; bits != 0; bits &= bits - 1)
    offsets[count++] = static_cast<std::uint8_t>(__builtin_ctzll(bits));
  first_ = float4::load(states[offsets[0]].position);
  if (previous_) return two_frames(count, [&](std::size_t i) { return offsets[i]; });
  return turn<kWithBox>(count, axes, points_, [&](std::size_t i) -> Float4 {
    return float4::load(states[offsets[i]].position);
  });
}

template <typename BV>
Extents BodyFit<BV>::extentsAlong(const Axes4& axes, const VertexSlots::Set& below) {
  const Ranges ranges = turnPoints<Volume<BV>::kHasBox>(below, axes);
  Extents extents = extentsOf(points_, ranges.z, few_);
  if constexpr (Volume<BV>::kHasBox) extents.ranges = ranges;
  return extents;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class BodyFit<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
