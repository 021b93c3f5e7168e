#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The binary part of a page: arrays one after the other, each at a multiple of four bytes, in the
/// byte order of this machine.
class Blob {
 public:
  /// Room for `count` numbers; returns where they begin.
  template <typename T>
  std::size_t extend(std::size_t count) {
    const std::size_t begin = (bytes_.size() + 3) / 4 * 4;
    bytes_.resize(begin + count * sizeof(T));
    return begin;
  }
  /// Valid until the next call of `extend`.
  template <typename T>
  T* at(std::size_t begin) {
    return reinterpret_cast<T*>(bytes_.data() + begin);
  }
  /// Appends numbers; returns where they begin.
  template <typename T>
  std::size_t append(const T* numbers, std::size_t count) {
    const std::size_t begin = extend<T>(count);
    if (count > 0) std::memcpy(bytes_.data() + begin, numbers, count * sizeof(T));
    return begin;
  }
  /// Takes back what was appended from `begin` on.
  void shrink(std::size_t begin) { bytes_.resize(begin); }

  std::size_t size() const { return bytes_.size(); }
  const std::uint8_t* data() const { return bytes_.data(); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Points in a Blob: each coordinate is low + n * size / 65535, n in 16 bits.
struct PointBlock {
  std::size_t begin = 0, count = 0;
  fcl::Vector3d low = fcl::Vector3d::Zero(), size = fcl::Vector3d::Zero();  ///< box around them
};

/// Appends points. What is nearest in 16 bits: off by at most half of size / 65535.
template <typename S>
PointBlock appendPoints(const fcl::Vector3<S>* points, std::size_t count, Blob& blob);

/// Whether both stand for the same points.
bool samePoints(const PointBlock& a, const PointBlock& b, const Blob& blob);

/// Numbers in a Blob: each is low + n * (high - low) / 65535, n in 16 bits.
struct ValueBlock {
  std::size_t begin = 0, count = 0;
  double low = 0, high = 0;
};

/// Appends finite numbers.
ValueBlock appendValues(const std::vector<double>& values, Blob& blob);

}  // namespace adaptive_bvh
