#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// Order of points along a Morton curve through the cells of a grid, by a counting sort. Neighbours
/// in this order are near each other, so the answer for one is a good bound for the next, and both
/// read the same nodes. Points of one cell keep their order.
class PointOrder {
 public:
  /// Orders `count` finite points, point(i). Keeps the memory.
  template <typename Point>
  void sort(std::size_t count, const Point& point) {
    order_.resize(count);
    if (count < kFew) return std::iota(order_.begin(), order_.end(), std::size_t(0));
    setGrid(count, point);
    cells_.resize(count);
    ends_.assign((std::size_t(1) << (3 * bits_)) + 1, 0);
    for (std::size_t i = 0; i < count; ++i) ++ends_[(cells_[i] = cellOf(point(i))) + 1];
    std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
    for (std::size_t i = 0; i < count; ++i) order_[ends_[cells_[i]]++] = i;
  }
  /// The index of the point at position i of the order.
  std::size_t operator[](std::size_t i) const { return order_[i]; }

 private:
  template <typename Point>
  void setGrid(std::size_t count, const Point& point) {
    fcl::Vector3d low = point(0), high = low;
    for (std::size_t i = 1; i < count; ++i) {
      const fcl::Vector3d x = point(i);
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    for (bits_ = 1; bits_ < kMostBits && (kPerCell << (3 * bits_)) < count;) ++bits_;
    low_ = low;
    to_cell_ = double(1u << bits_) * (high / 2 - low / 2).cwiseMax(kLeastSize).cwiseInverse();
  }
  std::uint32_t cellOf(const fcl::Vector3d& x) const {
    const std::uint32_t last = (1u << bits_) - 1;
    std::uint32_t cell = 0;
    for (int k = 0; k < 3; ++k) {
      const double at = (x[k] / 2 - low_[k] / 2) * to_cell_[k];
      cell |= spread(std::min(static_cast<std::uint32_t>(at), last)) << k;
    }
    return cell;
  }
  /// Puts two zeros between the bits of a number below 2^10.
  static std::uint32_t spread(std::uint32_t x) {
    x = (x | (x << 16)) & 0x030000ff;
    x = (x | (x << 8)) & 0x0300f00f;
    x = (x | (x << 4)) & 0x030c30c3;
    return (x | (x << 2)) & 0x09249249;
  }

  static constexpr std::size_t kFew = 64;       // points that need no order
  static constexpr std::size_t kPerCell = 2;    // points of a cell, about
  static constexpr int kMostBits = 7;           // of a coordinate
  static constexpr double kLeastSize = 1e-290;  // whose inverse, times cells, is finite

  std::vector<std::size_t> order_;
  std::vector<std::size_t> ends_;     ///< by cell: where its next point goes
  std::vector<std::uint32_t> cells_;  ///< by point
  fcl::Vector3d low_;
  fcl::Vector3d to_cell_;  ///< cells by half a length: differences of halves do not overflow
  int bits_ = 1;
};

}  // namespace adaptive_bvh
