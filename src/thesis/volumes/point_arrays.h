#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include <fcl/common/types.h>

#include "thesis/volumes/body_volumes.h"

// Arrays of points, for fits in the model's precision and for the choice of axes (swept_fit.h).
namespace adaptive_bvh {

/// The operations of Lanes<Float4> (body_volumes.h) that such fits use, for double precision.
template <>
struct Lanes<Pack<double>> {
  static constexpr int kCount = 2;

  struct Four {
    double numbers[4];
    double operator[](int k) const { return numbers[k]; }
  };
  /// The largest number of each pack.
  ADAPTIVE_BVH_INLINE static Four largest(const Pack<double>& a, const Pack<double>& b,
                                          const Pack<double>& c, const Pack<double>& d) {
    return {packs::largest(a), packs::largest(b), packs::largest(c), packs::largest(d)};
  }
};

/// Points as three arrays of numbers, for vector instructions. The last pack is filled up with
/// copies of the first point, which change neither extents nor sums about that point. The arrays
/// never shrink, so once the largest set has been stored, nothing is allocated.
template <typename S>
class PointArrays {
 public:
  using Point = fcl::Vector3<S>;

  void clear() { size_ = 0; }
  /// Reserves memory for `more` points, at most `kGranule`. Call it before adding them.
  void makeRoomFor(std::size_t more) {
    if (size_ + more > room()) makeRoom(2 * room() + kGranule);
  }
  void add(const Point& p) {
    for (int k = 0; k < 3; ++k) numbers_[k][size_] = p[k];
    ++size_;
  }
  /// Fills up the last pack; call it after adding the last point.
  void fillUp() {
    for (std::size_t i = size_; i % packs::kSize<S> != 0; ++i)
      for (auto& numbers : numbers_) numbers[i] = numbers[0];
  }

  /// Becomes every `stride`-th of `points`.
  void assign(const PointArrays& points, std::size_t stride) {
    clear();
    for (std::size_t i = 0; i < points.size(); i += stride) {
      makeRoomFor(1);
      add(points[i]);
    }
    fillUp();
  }
  /// Becomes the components of `points` along axes, relative to the first point.
  void assign(const PointArrays& points, const Axes<Pack<S>>& axes) {
    if (room() < points.size()) makeRoom((points.size() / kGranule + 1) * kGranule);
    size_ = points.size();
    const Vectors<Pack<S>> first = points.first();
    points.forEachPack([&](std::size_t i, const Vectors<Pack<S>>& p) {
      put(i, axes.components(vectors::difference(p, first)));
    });
  }
  /// Changes to the components along axes that are rotated about z by an angle.
  void turn(S cosine, S sine) {
    forEachPack([&](std::size_t i, const Vectors<Pack<S>>& p) {
      put(i, {cosine * p.x + sine * p.y, cosine * p.y - sine * p.x, p.z});
    });
  }

  std::size_t size() const { return size_; }
  Point operator[](std::size_t i) const { return {numbers_[0][i], numbers_[1][i], numbers_[2][i]}; }
  /// The first point, repeated in every lane.
  Vectors<Pack<S>> first() const {
    return {packs::all(numbers_[0][0]), packs::all(numbers_[1][0]), packs::all(numbers_[2][0])};
  }
  /// The pack of points from i on; i is a multiple of the pack's size.
  ADAPTIVE_BVH_INLINE Vectors<Pack<S>> at(std::size_t i) const {
    return {packs::load(&numbers_[0][i]), packs::load(&numbers_[1][i]),
            packs::load(&numbers_[2][i])};
  }
  /// Calls visit(i, at(i)) for each pack.
  template <typename Visit>
  ADAPTIVE_BVH_INLINE void forEachPack(Visit&& visit) const {
    for (std::size_t i = 0; i < size_; i += packs::kSize<S>) visit(i, at(i));
  }

 private:
  static constexpr std::size_t kGranule = 64;  ///< unit of growth, a multiple of the pack's size
  /// Number of points for which all arrays have memory: the size of the one that grows last.
  std::size_t room() const { return numbers_.back().size(); }
  void makeRoom(std::size_t points) {
    for (auto& numbers : numbers_) numbers.resize(points);
  }
  /// Sets the pack of points from i on.
  ADAPTIVE_BVH_INLINE void put(std::size_t i, const Vectors<Pack<S>>& p) {
    packs::store<S>(p.x, &numbers_[0][i]);
    packs::store<S>(p.y, &numbers_[1][i]);
    packs::store<S>(p.z, &numbers_[2][i]);
  }

  std::array<std::vector<S>, 3> numbers_;  ///< x, y and z; longer than `size_`
  std::size_t size_ = 0;                   ///< number of points
};

/// The smallest and the largest of many numbers.
template <typename S>
class Extent {
 public:
  ADAPTIVE_BVH_INLINE void add(const Pack<S>& numbers) {
    low_ = packs::lower(low_, numbers);
    high_ = packs::upper(high_, numbers);
  }
  S low() const { return packs::smallest(low_); }
  S high() const { return packs::largest(high_); }
  S middle() const { return (low() + high()) / 2; }
  S length() const { return high() - low(); }

 private:
  Pack<S> low_ = packs::all(std::numeric_limits<S>::max());
  Pack<S> high_ = packs::all(std::numeric_limits<S>::lowest());
};

}  // namespace adaptive_bvh
