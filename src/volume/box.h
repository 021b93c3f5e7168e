#pragma once

#include <Eigen/Core>

namespace adaptive_bvh {

/// Four numbers in single precision, worked on at once. Three of them mean x, y, z; the fourth
/// comes along and means nothing.
using Lanes = Eigen::Array4f;

/// x + y + z, or their largest.
inline float sumOf(const Lanes& v) { return v[0] + v[1] + v[2]; }
inline float largestOf(const Lanes& v) { return std::max(std::max(v[0], v[1]), v[2]); }

/// All points between two corners.
struct Box {
  Lanes low, high;

  void add(const Box& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  void add(const Lanes& point) { add(Box{point, point}); }
};

}  // namespace adaptive_bvh
