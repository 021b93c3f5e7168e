#pragma once

#include <cstddef>
#include <cstdint>

#include "volumes/body_volumes.h"

// Also compiled for AVX2: see volumes/fit_kernels.h.
namespace adaptive_bvh {

/// Some points in an array: those at some offsets, or all.
struct PointSet {
  const float* base;
  std::size_t stride;           ///< in numbers
  const std::uint8_t* offsets;  ///< null: all
  std::size_t count;
};

/// How far the points of one node extend along axes x, y and z, from one of them: many points, as
/// many at a time as there are lanes.
template <typename P>
class PointExtents {
 public:
  /// `axes`: of a lane. `work`: room for the coordinates of all points along the axes, and as many
  /// as there are lanes for each set.
  ADAPTIVE_BVH_INLINE PointExtents(const Axes<P>& axes, int lane, const Float4& first,
                                   float* const (&work)[3])
      : axes_{broadcast(axes.x, lane), broadcast(axes.y, lane), broadcast(axes.z, lane)},
        first_{filled(first[0]), filled(first[1]), filled(first[2])},
        work_{work[0], work[1], work[2]} {}

  ADAPTIVE_BVH_INLINE void add(const PointSet& set) {
    if (set.offsets)
      add(set, [&](std::size_t i) -> std::size_t { return set.offsets[i]; });
    else
      add(set, [](std::size_t i) -> std::size_t { return i; });
  }

  ADAPTIVE_BVH_INLINE void finish() {
    const Float4 heights = Lanes<P>::largest(-range_.low.z, range_.high.z, P{}, P{});
    SlabRectangle<P> of(filled(-heights[0]), filled(heights[1]));
    for (std::size_t i = 0; i < count_; i += Lanes<P>::kCount) of.add(at(i));
    const Float4 ends = endsOf(of);
    for (int k = 0; k < 2; ++k) {
      of.low[k] = filled(ends[k]);
      of.high[k] = filled(ends[k + 2]);
    }
    of.close();
    for (std::size_t i = 0; i < count_; i += Lanes<P>::kCount) of.addCorner(at(i));
    of.finish();
    rectangle = endsOf(of);
    sphere = Float4{of.middle[0], of.radius[0], 0, 0};
    box = ends4(range_.low.x, range_.low.y, range_.high.x, range_.high.y);
  }

  Float4 rectangle;  ///< of a SlabRectangle: low x, low y, high x, high y
  Float4 sphere;     ///< its plane and its radius
  Float4 box;        ///< of the points: low x, low y, high x, high y

 private:
  ADAPTIVE_BVH_INLINE static P filled(float x) { return packs::filled<P>(x); }
  ADAPTIVE_BVH_INLINE static Vectors<P> broadcast(const Vectors<P>& v, int lane) {
    return {filled(v.x[lane]), filled(v.y[lane]), filled(v.z[lane])};
  }
  ADAPTIVE_BVH_INLINE static Float4 ends4(const P& low_x, const P& low_y, const P& high_x,
                                          const P& high_y) {
    const Float4 far = Lanes<P>::largest(-low_x, -low_y, high_x, high_y);
    return Float4{-far[0], -far[1], far[2], far[3]};
  }
  ADAPTIVE_BVH_INLINE static Float4 endsOf(const SlabRectangle<P>& of) {
    return ends4(of.low[0], of.low[1], of.high[0], of.high[1]);
  }

  template <typename Index>
  ADAPTIVE_BVH_INLINE void add(const PointSet& set, Index&& index) {
    const auto load = [&](std::size_t i) -> Float4 {
      return packs::load(set.base + set.stride * index(i));
    };
    std::size_t i = 0;
    for (; i + Lanes<P>::kCount <= set.count; i += Lanes<P>::kCount)
      put(Lanes<P>::gather([&](std::size_t k) -> Float4 { return load(i + k); }));
    if (i < set.count)  // the last one again where there are no more
      put(Lanes<P>::gather([&](std::size_t k) -> Float4 {
        return load(i + k < set.count ? i + k : set.count - 1);
      }));
  }
  ADAPTIVE_BVH_INLINE void put(const Vectors<P>& points) {
    const Vectors<P> along = axes_.components(vectors::difference(points, first_));
    range_.add(along);
    __builtin_memcpy(work_[0] + count_, &along.x, sizeof(P));
    __builtin_memcpy(work_[1] + count_, &along.y, sizeof(P));
    __builtin_memcpy(work_[2] + count_, &along.z, sizeof(P));
    count_ += Lanes<P>::kCount;
  }
  ADAPTIVE_BVH_INLINE Vectors<P> at(std::size_t i) const {
    Vectors<P> point;
    __builtin_memcpy(&point.x, work_[0] + i, sizeof(P));
    __builtin_memcpy(&point.y, work_[1] + i, sizeof(P));
    __builtin_memcpy(&point.z, work_[2] + i, sizeof(P));
    return point;
  }

  const Axes<P> axes_;
  const Vectors<P> first_;
  float* const work_[3];
  std::size_t count_ = 0;
  PointRange<P> range_{};  ///< and `first`
};

}  // namespace adaptive_bvh
