#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include <fcl/common/types.h>

// The web page that plays a recorded run: its binary data (Blob), and how it is written.
namespace adaptive_bvh {

/// The binary part of a page: a sequence of arrays in this machine's byte order. Grows without
/// moving its content, so pointers into it stay valid.
class Blob {
 public:
  /// Each array takes a multiple of 12 bytes: 4 to align numbers, 3 for groups of base64.
  static constexpr std::size_t kUnit = 12;

  /// Appends an array of `count` numbers. Returns a pointer to them, for the caller to write. The
  /// array begins at the value of size() before the call.
  template <typename T>
  T* extend(std::size_t count) {
    const std::size_t bytes = (count * sizeof(T) + kUnit - 1) / kUnit * kUnit;
    if (parts_.empty() || parts_.back().capacity() - parts_.back().size() < bytes) {
      constexpr std::size_t kPartBytes = std::size_t(1) << 20;
      parts_.emplace_back().reserve(std::max(bytes, kPartBytes));
    }
    std::vector<std::uint8_t>& part = parts_.back();
    const std::size_t begin = part.size();
    part.resize(begin + bytes);
    size_ += bytes;
    return reinterpret_cast<T*>(part.data() + begin);
  }
  /// Appends a copy of numbers. Returns a pointer to it.
  template <typename T>
  const T* append(const std::vector<T>& numbers) {
    T* const out = extend<T>(numbers.size());
    std::copy(numbers.begin(), numbers.end(), out);
    return out;
  }
  /// Removes everything that was appended from `begin` on.
  void takeBack(std::size_t begin) {
    while (size_ > begin) {
      std::vector<std::uint8_t>& part = parts_.back();
      const std::size_t bytes = std::min(part.size(), size_ - begin);
      part.resize(part.size() - bytes);
      size_ -= bytes;
      if (size_ > begin) parts_.pop_back();
    }
  }

  std::size_t size() const { return size_; }  ///< the number of bytes
  /// The content: all parts, one after the other. The size of each is a multiple of kUnit.
  const std::vector<std::vector<std::uint8_t>>& parts() const { return parts_; }

 private:
  std::vector<std::vector<std::uint8_t>> parts_;  ///< none grows beyond its capacity
  std::size_t size_ = 0;
};

/// Quantizes numbers x of an interval [low, low + size] to 16-bit numbers n: x = low + n * size /
/// kSteps, with an error of at most half a step.
class Steps {
 public:
  static constexpr double kSteps = 65535;

  Steps(double low, double size) : low_(low), scale_(size > 0 ? kSteps / size : 0) {}
  std::uint16_t operator()(double number) const {
    const double rounded_when_truncated = (number - low_) * scale_ + 0.5;
    return static_cast<std::uint16_t>(static_cast<int>(rounded_when_truncated));
  }

 private:
  double low_, scale_;  ///< scale_ is the number of steps per unit
};

/// Points in a Blob, with coordinates quantized relative to their bounding box.
struct PointBlock {
  const std::uint16_t* steps = nullptr;  ///< in the Blob: three per point (see Steps)
  std::size_t begin = 0, count = 0;      ///< beginning in the Blob; number of points
  /// The lower corner and the sides of the bounding box.
  fcl::Vector3d low = fcl::Vector3d::Zero(), size = fcl::Vector3d::Zero();

  /// Whether both contain the same quantized points.
  bool operator==(const PointBlock& other) const {
    return count == other.count && low == other.low && size == other.size &&
           std::equal(steps, steps + 3 * count, other.steps);
  }
};

/// Appends points, which must be finite.
inline PointBlock appendPoints(const fcl::Vector3d* points, std::size_t count, Blob& blob) {
  PointBlock block;
  block.begin = blob.size();
  block.count = count;
  auto* out = blob.extend<std::uint16_t>(3 * count);
  block.steps = out;
  if (count == 0) return block;
  fcl::Vector3d low = points[0], high = points[0];
  for (std::size_t i = 1; i < count; ++i) {
    low = low.cwiseMin(points[i]);
    high = high.cwiseMax(points[i]);
  }
  block.low = low;
  block.size = high - block.low;
  const Steps axes[] = {
      {block.low[0], block.size[0]}, {block.low[1], block.size[1]}, {block.low[2], block.size[2]}};
  for (std::size_t i = 0; i < count; ++i, out += 3)
    for (int k = 0; k < 3; ++k) out[k] = axes[k](static_cast<double>(points[i][k]));
  return block;
}

/// Writes the HTML page that plays a run. `run` describes it as JSON (page/data.js reads it), and
/// refers to `arrays` by positions in bytes.
void writePage(const std::string& title, const std::string& run, const Blob& arrays,
               std::ostream& out);

}  // namespace adaptive_bvh
