#include "blob.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

constexpr double kSteps = 65535;

/// Steps by unit of length; none along a side without length.
double stepsBy(double size) { return size > 0 ? kSteps / size : 0; }

std::uint16_t rounded(double steps) { return static_cast<std::uint16_t>(steps + 0.5); }

}  // namespace

template <typename S>
PointBlock appendPoints(const fcl::Vector3<S>* points, std::size_t count, Blob& blob) {
  PointBlock block;
  block.count = count;
  block.begin = blob.extend<std::uint16_t>(3 * count);
  if (count == 0) return block;

  fcl::Vector3<S> low = points[0], high = points[0];
  for (std::size_t i = 1; i < count; ++i)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], points[i][k]);
      high[k] = std::max(high[k], points[i][k]);
    }
  block.low = low.template cast<double>();
  block.size = high.template cast<double>() - block.low;

  const double scale[3] = {stepsBy(block.size[0]), stepsBy(block.size[1]), stepsBy(block.size[2])};
  const double from[3] = {block.low[0], block.low[1], block.low[2]};
  auto* const out = blob.at<std::uint16_t>(block.begin);
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k)
      out[3 * i + static_cast<std::size_t>(k)] =
          rounded((static_cast<double>(points[i][k]) - from[k]) * scale[k]);
  return block;
}

bool samePoints(const PointBlock& a, const PointBlock& b, const Blob& blob) {
  return a.count == b.count && a.low == b.low && a.size == b.size &&
         std::memcmp(blob.data() + a.begin, blob.data() + b.begin, 6 * a.count) == 0;
}

ValueBlock appendValues(const std::vector<double>& values, Blob& blob) {
  ValueBlock block;
  block.count = values.size();
  block.begin = blob.extend<std::uint16_t>(values.size());
  if (values.empty()) return block;
  const auto ends = std::minmax_element(values.begin(), values.end());
  block.low = *ends.first;
  block.high = *ends.second;
  const double scale = stepsBy(block.high - block.low);
  auto* const out = blob.at<std::uint16_t>(block.begin);
  for (std::size_t i = 0; i < values.size(); ++i)
    out[i] = rounded((values[i] - block.low) * scale);
  return block;
}

template PointBlock appendPoints(const fcl::Vector3<float>*, std::size_t, Blob&);
template PointBlock appendPoints(const fcl::Vector3<double>*, std::size_t, Blob&);

}  // namespace adaptive_bvh
