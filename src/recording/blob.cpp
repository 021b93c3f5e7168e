#include "blob.h"

namespace adaptive_bvh {
namespace {

constexpr double kSteps = 65535;

/// Steps by unit of length; none along a side without length.
double stepsBy(double size) { return size > 0 ? kSteps / size : 0; }

/// Of 0 to 65535.
std::uint16_t rounded(double steps) {
  const double half_above = steps + 0.5;
  return static_cast<std::uint16_t>(static_cast<int>(half_above));
}

/// Coordinates are taken twelve at a time, those of four points, for compilers to use vectors.
constexpr std::size_t kGroup = 12;

/// The box around points, whose coordinates are `numbers` one after the other.
template <typename S>
void setBox(const S* numbers, std::size_t count, PointBlock& block) {
  S low[kGroup], high[kGroup];
  for (std::size_t k = 0; k < kGroup; ++k) low[k] = high[k] = numbers[k % 3];
  const auto include = [&](const S* from, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) {
      low[k] = from[k] < low[k] ? from[k] : low[k];
      high[k] = high[k] < from[k] ? from[k] : high[k];
    }
  };
  std::size_t i = 0;
  for (; i + kGroup <= count; i += kGroup) include(numbers + i, kGroup);
  include(numbers + i, count - i);
  for (int k = 0; k < 3; ++k) {
    const S least = std::min({low[k], low[k + 3], low[k + 6], low[k + 9]});
    const S most = std::max({high[k], high[k + 3], high[k + 6], high[k + 9]});
    block.low[k] = static_cast<double>(least);
    block.size[k] = static_cast<double>(most) - block.low[k];
  }
}

template <typename S>
void writeSteps(const S* numbers, std::size_t count, const PointBlock& block, std::uint16_t* out) {
  double from[kGroup], by[kGroup];
  for (std::size_t k = 0; k < kGroup; ++k) {
    from[k] = block.low[static_cast<int>(k % 3)];
    by[k] = stepsBy(block.size[static_cast<int>(k % 3)]);
  }
  std::size_t i = 0;
  for (; i + kGroup <= count; i += kGroup)
    for (std::size_t k = 0; k < kGroup; ++k)
      out[i + k] = rounded((static_cast<double>(numbers[i + k]) - from[k]) * by[k]);
  for (std::size_t k = 0; i + k < count; ++k)
    out[i + k] = rounded((static_cast<double>(numbers[i + k]) - from[k]) * by[k]);
}

}  // namespace

template <typename S>
PointBlock appendPoints(const fcl::Vector3<S>* points, std::size_t count, Blob& blob) {
  static_assert(sizeof(fcl::Vector3<S>) == 3 * sizeof(S), "points are numbers in a row");
  PointBlock block;
  block.count = count;
  block.begin = blob.size();
  auto* const out = blob.extend<std::uint16_t>(3 * count);
  block.steps = out;
  if (count == 0) return block;
  setBox(points->data(), 3 * count, block);
  writeSteps(points->data(), 3 * count, block, out);
  return block;
}

bool samePoints(const PointBlock& a, const PointBlock& b) {
  return a.count == b.count && a.low == b.low && a.size == b.size &&
         std::memcmp(a.steps, b.steps, 6 * a.count) == 0;
}

ValueBlock appendValues(const std::vector<double>& values, Blob& blob) {
  ValueBlock block;
  block.begin = blob.size();
  auto* out = blob.extend<std::uint16_t>(values.size());
  if (values.empty()) return block;
  const auto ends = std::minmax_element(values.begin(), values.end());
  block.low = *ends.first;
  block.high = *ends.second;
  const double by = stepsBy(block.high - block.low);
  for (const double value : values) *out++ = rounded((value - block.low) * by);
  return block;
}

template PointBlock appendPoints(const fcl::Vector3<float>*, std::size_t, Blob&);
template PointBlock appendPoints(const fcl::Vector3<double>*, std::size_t, Blob&);

}  // namespace adaptive_bvh
