#pragma once

#include <chrono>

namespace adaptive_bvh {

/// Measures elapsed time.
class Stopwatch {
 public:
  /// The seconds since the construction or the previous lap.
  double lap() {
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> elapsed = now - last_;
    last_ = now;
    return elapsed.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

}  // namespace adaptive_bvh
