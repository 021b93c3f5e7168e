#include "update/body_fit.h"

#include <algorithm>
#include <cmath>

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

/// A vector as long as 1 up to rounding, from one that is up to 1e-5: the series of 1 / sqrt(n)
/// about 1, whose next term is below 1e-15.
fcl::Vector3d unitVector(const fcl::Vector3d& v) {
  const double d = v.squaredNorm() - 1;
  return v * (1 - d * (0.5 - d * 0.375));
}

/// The axes in the model's coordinates, orthonormal up to rounding.
template <typename S>
fcl::Matrix3<S> toModel(const fcl::Matrix3d& frame, const Axes4& axes) {
  const auto turned = [&](const Float4& v) -> fcl::Vector3d {
    return frame.col(0) * double(v[0]) + frame.col(1) * double(v[1]) + frame.col(2) * double(v[2]);
  };
  const fcl::Vector3d x = unitVector(turned(axes.x)), askew = turned(axes.y);
  const fcl::Vector3d y = unitVector(askew - x * x.dot(askew));
  fcl::Matrix3<S> result;
  result << x.template cast<S>(), y.template cast<S>(), x.cross(y).template cast<S>();
  return result;
}

template <typename Matrix>
Axes4 columnsOf(const Matrix& axes) {
  const auto column = [&](int k) -> Float4 {
    return Float4{float(axes(0, k)), float(axes(1, k)), float(axes(2, k)), 0};
  };
  return {column(0), column(1), column(2)};
}

/// What a fit's error is beyond its own operations: see volumeAlong.
template <typename S>
S errorIn(const BodyFrame<S>& frame, float extent) {
  const S length = S(extent) * frame.unit();
  return 2 * S(BodyFrame<S>::kError) * length +
         16 * rounding::epsilon<S>() * (frame.origin().template lpNorm<1>() + 8 * length) +
         rounding::tiny<S>();
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
      unit_(frame_.unit()),
      error_(errorIn(frame_, target.tree.boxes->root().largestCoordinate())),
      points_(workSpace().points),
      few_(workSpace().few) {}

template <typename BV>
BV BodyFit<BV>::operator()(int node) {
  const fcl::BVNode<BV>& fcl_node = target_.model.getBV(node);
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  const auto count = static_cast<std::size_t>(fcl_node.num_primitives);
  if (count == 1 && !previous_) return fitTriangle(first);
  const VertexSlots::Set below = slots_.below(first, count);
  if (count == 2) {
    const Axes4 axes = pairAxes(first, below);
    return volumeAlong(axes, pairExtents(axes, below));
  }
  if (count == 1) {  // in two frames
    const Axes4 axes = bestAxesOf(below);
    return volumeAlong(axes, extentsAlong(axes, below));
  }
  KeptAxes& kept = kept_[target_.tree.boxes->nodes().largeIndex(node)];
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
  const Axes4 frame = nodeFrame(static_cast<std::size_t>(fcl_node.first_primitive),
                                static_cast<std::size_t>(fcl_node.num_primitives));
  const fcl::Matrix3d in_body =
      frame_.axes().transpose() * Volume<BV>::axes(bv).template cast<double>();
  const Axes4 axes = columnsOf(in_body);
  const auto scale = static_cast<double>(frame_.scale());
  kept_[target_.tree.boxes->nodes().largeIndex(node)] = {
      PackedRotation(frame.components(axes)),
      static_cast<float>(Volume<BV>::surfaceArea(bv) * scale * scale)};
}

/// The rectangle on the longest edge: twice the area of the triangle, the least any rectangle has.
/// The axes of a needle are off, so what they leave of a height is measured as well.
template <typename BV>
BV BodyFit<BV>::fitTriangle(std::size_t leaf) {
  const VertexIndices slots = slots_.slotsOf(leaf);
  const Float4 p = at(slots[0]), q = at(slots[1]), r = at(slots[2]);
  const Float4 edges[3] = {q - p, r - q, p - r};
  const Float4 squares =
      float4::sums(edges[0] * edges[0], edges[1] * edges[1], edges[2] * edges[2], edges[0]);
  const int longest = squares[0] >= squares[1] ? (squares[0] >= squares[2] ? 0 : 2)
                                               : (squares[1] >= squares[2] ? 1 : 2);
  const Float4 along = edges[longest], apex = -edges[longest > 0 ? longest - 1 : 2];
  first_ = longest == 0 ? p : longest == 1 ? q : r;
  const Axes4 axes = axesAlong(along, apex);
  const Axes4::Components coordinates(axes);
  const Float4 none = float4::all(0), a = coordinates(along), b = coordinates(apex);
  const Float4 low = float4::lower(float4::lower(a, b), none),
               high = float4::upper(float4::upper(a, b), none);
  return volumeAlong(axes, {{low[0], low[1], (low[2] + high[2]) / 2},
                            {high[0] - low[0], high[1] - low[1]},
                            (high[2] - low[2]) / 2,
                            {{low[0], high[0]}, {low[1], high[1]}, {low[2], high[2]}}});
}

/// Two triangles with a common edge are four points: of all pairs of planes between which they lie,
/// those through the diagonals are nearest. In them, the least rectangle has a side along one of
/// the outer edges.
template <typename BV>
Axes4 BodyFit<BV>::pairAxes(std::size_t leaf, const VertexSlots::Set& below) {
  const VertexIndices s = slots_.slotsOf(leaf), t = slots_.slotsOf(leaf + 1);
  const auto has = [](const VertexIndices& of, unsigned v) {
    return (of[0] == v) + (of[1] == v) + (of[2] == v);
  };
  const int in_t[3] = {has(t, s[0]), has(t, s[1]), has(t, s[2])};
  const int i = !in_t[0] ? 0 : !in_t[1] ? 1 : 2, j = !has(s, t[0]) ? 0 : !has(s, t[1]) ? 1 : 2;
  if (in_t[0] + in_t[1] + in_t[2] != 2 || has(s, t[std::size_t(j)])) return bestAxesOf(below);

  const Float4 a = at(s[std::size_t(i < 2 ? i + 1 : 0)]), b = at(s[std::size_t(i > 0 ? i - 1 : 2)]),
               c = at(s[std::size_t(i)]), d = at(t[std::size_t(j)]);
  const Axes4 axes = axesAlong(b - a, d - c);
  // Around: a, c, b, d, a lane for each, and the next of each.
  const Float4 none = float4::all(0);
  const float4::Columns around = float4::columns(none, c - a, b - a, d - a);
  const auto along = [&](const Float4& axis) -> Float4 {
    return around.x * axis[0] + around.y * axis[1] + around.z * axis[2];
  };
  const Float4 x = along(axes.x), y = along(axes.y);
  const Float4 dx = Float4{x[1], x[2], x[3], x[0]} - x, dy = Float4{y[1], y[2], y[3], y[0]} - y;
  Float4 low_x = float4::all(0), high_x = low_x, low_y = low_x, high_y = low_x;  // of a
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
  const Float4 lengths = float4::squareRoot(squares);
  if (!(squares[best] > kTiny)) return axes;
  return axes.turned(dx[best] / lengths[best], dy[best] / lengths[best]);
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

/// Four points on two planes: no sphere of half their distance lets the rectangle end within them.
template <typename BV>
Extents BodyFit<BV>::pairExtents(const Axes4& axes, const VertexSlots::Set& below) {
  const Ranges ranges = turnPoints<true>(below, axes);
  const float a = ranges.x.length(), b = ranges.y.length(), half = ranges.z.length() / 2;
  if (half > 0.1f * (a + b)) return extentsAlong(axes, below);
  return {{ranges.x.low, ranges.y.low, (ranges.z.low + ranges.z.high) / 2}, {a, b}, half, ranges};
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

/// Let e be the extent, u = 2^-24. A point of the body is off by less than 35 u e, and the corner
/// by 8 u e: 2 kError e = 64 u e covers both. The rest is relative to the sides and the diameter:
/// axes that are orthonormal to 90 u only, twice that, and 16 u for local coordinates, distances
/// and the corner. docs/bounds.md, 11.
template <typename BV>
BV BodyFit<BV>::volumeAlong(const Axes4& axes, const Extents& extents) const {
  constexpr float kOperations = 1.f / (1 << 16);
  const float error = kOperations * (extents.sides[0] + extents.sides[1] + 2 * extents.radius);
  const Float4 corner =
      first_ + axes.combine(extents.corner[0], extents.corner[1], extents.corner[2]);
  return Volume<BV>::along(toModel<S>(frame_.axes(), axes), frame_.fromBodyFrame(corner), extents,
                           unit_, error_ + S(error) * unit_);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class BodyFit<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
