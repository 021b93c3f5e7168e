#pragma once

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>

namespace adaptive_bvh_bench {

/// A bar on a terminal, nothing elsewhere.
class ProgressBar {
 public:
  explicit ProgressBar(bool on) : on_(on && isatty(STDERR_FILENO)) {}
  ~ProgressBar() {
    if (on_) std::fprintf(stderr, "\r\033[K");
  }
  void show(double share, const std::string& what) const {
    if (!on_) return;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    const double left = share > 0.01 ? elapsed.count() * (1 - share) / share : 0;
    std::fprintf(stderr, "\r\033[K[%-30.*s] %3.0f %%  %s left  %s", int(30 * share),
                 "##############################", 100 * share,
                 left > 0 ? (std::to_string(int(left)) + " s").c_str() : "?", what.c_str());
  }

 private:
  bool on_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace adaptive_bvh_bench
