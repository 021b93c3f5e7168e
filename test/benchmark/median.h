#pragma once

#include <algorithm>
#include <vector>

namespace adaptive_bvh_bench {

/// The middle one; the lower of two.
inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[(values.size() - 1) / 2];
}

}  // namespace adaptive_bvh_bench
