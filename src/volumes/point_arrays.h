#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <fcl/common/types.h>

#include "base/pack.h"

namespace adaptive_bvh {

/// Points as three arrays of numbers, for vector instructions. The last pack is filled up with
/// copies of the first point: they change neither extents nor sums about that point. The arrays
/// only grow, so from the largest set on nothing is allocated.
template <typename S>
class PointArrays {
 public:
  using Point = fcl::Vector3<S>;

  void clear() { size_ = 0; }
  /// Reserves memory for `more` points, at most `kGranule`. Call it before adding them.
  void makeRoomFor(std::size_t more) {
    if (size_ + more > numbers_[0].size()) makeRoom(2 * numbers_[0].size() + kGranule);
  }
  void add(const Point& p) {
    for (int k = 0; k < 3; ++k) numbers_[k][size_] = p[k];
    ++size_;
  }
  /// After the last point.
  void fillUp() {
    for (std::size_t i = size_; i % packs::kSize<S> != 0; ++i)
      for (auto& numbers : numbers_) numbers[i] = numbers[0];
  }

  /// Every `stride`-th of some points.
  void assign(const PointArrays& points, std::size_t stride) {
    clear();
    for (std::size_t i = 0; i < points.size(); i += stride) {
      makeRoomFor(1);
      add(points[i]);
    }
    fillUp();
  }

  /// Some points in a frame about the first of them.
  void assign(const PointArrays& points, const fcl::Matrix3<S>& frame) {
    if (numbers_[0].size() < points.size()) makeRoom((points.size() / kGranule + 1) * kGranule);
    size_ = points.size();
    const Point first = points[0];
    for (std::size_t i = 0; i < size_; i += packs::kSize<S>) {
      const Pack<S> x = points.pack(0, i) - first[0], y = points.pack(1, i) - first[1],
                    z = points.pack(2, i) - first[2];
      for (int k = 0; k < 3; ++k)
        packs::store<S>(frame(0, k) * x + frame(1, k) * y + frame(2, k) * z, &numbers_[k][i]);
    }
  }

  /// Turns the frame by an angle in its plane of x and y, given as a unit vector.
  void turn(S cosine, S sine) {
    for (std::size_t i = 0; i < size_; i += packs::kSize<S>) {
      const Pack<S> x = pack(0, i), y = pack(1, i);
      packs::store<S>(cosine * x + sine * y, &numbers_[0][i]);
      packs::store<S>(cosine * y - sine * x, &numbers_[1][i]);
    }
  }

  std::size_t size() const { return size_; }
  Point operator[](std::size_t i) const { return {numbers_[0][i], numbers_[1][i], numbers_[2][i]}; }
  /// Coordinate k of the points from i on, a multiple of the pack's size.
  ADAPTIVE_BVH_INLINE Pack<S> pack(int k, std::size_t i) const {
    return packs::load(&numbers_[k][i]);
  }

 private:
  static constexpr std::size_t kGranule = 64;  // a multiple of the pack's size
  void makeRoom(std::size_t points) {
    for (auto& numbers : numbers_) numbers.resize(points);
  }

  std::array<std::vector<S>, 3> numbers_;
  std::size_t size_ = 0;
};

}  // namespace adaptive_bvh
