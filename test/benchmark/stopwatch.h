#pragma once

#include <chrono>

namespace adaptive_bvh_bench {

/// How long it takes to call `work`.
template <typename Work>
double milliseconds(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

}  // namespace adaptive_bvh_bench
