#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The binary part of a page: arrays one after the other, each at a multiple of four bytes, in the
/// byte order of this machine. Grows without moving what it holds.
class Blob {
 public:
  /// A piece of it.
  struct Part {
    std::unique_ptr<std::uint8_t[]> bytes;
    std::size_t size = 0, capacity = 0;
  };

  /// Room for `count` numbers, which are to be written, at size() before the call.
  template <typename T>
  T* extend(std::size_t count) {
    const std::size_t bytes = (count * sizeof(T) + 3) / 4 * 4;
    if (parts_.empty() || parts_.back().capacity - parts_.back().size < bytes) addPart(bytes);
    Part& part = parts_.back();
    std::uint8_t* const begin = part.bytes.get() + part.size;
    std::fill(begin + count * sizeof(T), begin + bytes, std::uint8_t(0));
    part.size += bytes;
    size_ += bytes;
    return reinterpret_cast<T*>(begin);
  }
  /// Appends numbers; returns them as they lie here.
  template <typename T>
  const T* append(const T* numbers, std::size_t count) {
    return std::copy(numbers, numbers + count, extend<T>(count)) - count;
  }
  /// Takes back the last `bytes`, which one call has appended.
  void takeBack(std::size_t bytes) {
    parts_.back().size -= bytes;
    size_ -= bytes;
  }

  std::size_t size() const { return size_; }
  const std::vector<Part>& parts() const { return parts_; }

 private:
  /// Not filled with zeros: memory that was not touched yet is expensive.
  void addPart(std::size_t least) {
    constexpr std::size_t kUsual = std::size_t(1) << 20;
    Part part;
    part.capacity = std::max(least, kUsual);
    part.bytes.reset(new std::uint8_t[part.capacity]);
    parts_.push_back(std::move(part));
  }

  std::vector<Part> parts_;
  std::size_t size_ = 0;
};

/// Points in a Blob: each coordinate is low + n * size / 65535, n in 16 bits.
struct PointBlock {
  const std::uint16_t* steps = nullptr;  ///< the n
  std::size_t begin = 0, count = 0;      ///< where they are in the Blob; how many points
  fcl::Vector3d low = fcl::Vector3d::Zero(), size = fcl::Vector3d::Zero();  ///< box around them
};

/// Appends finite points. Each coordinate as near as 16 bits allow: off by at most half of size /
/// 65535.
template <typename S>
PointBlock appendPoints(const fcl::Vector3<S>* points, std::size_t count, Blob& blob);

/// Whether both stand for the same points.
bool samePoints(const PointBlock& a, const PointBlock& b);

/// Numbers in a Blob: each is low + n * (high - low) / 65535, n in 16 bits.
struct ValueBlock {
  std::size_t begin = 0;
  double low = 0, high = 0;
};

/// Appends finite numbers.
ValueBlock appendValues(const std::vector<double>& values, Blob& blob);

}  // namespace adaptive_bvh
