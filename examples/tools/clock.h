#pragma once

#include <chrono>

namespace tools {

/// Runs from its construction.
class Clock {
 public:
  /// Since the last call, or since the start.
  double milliseconds() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace tools
