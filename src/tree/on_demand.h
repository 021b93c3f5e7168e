#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

namespace adaptive_bvh {

/// What queries derive from one state of a model, and keep: made by the first query that needs it,
/// so that who asks for something else does not pay. Queries on many threads may ask at once; one
/// of them does the work, the others wait. A copy begins without it.
template <typename T>
class OnDemand {
 public:
  OnDemand() = default;
  OnDemand(const OnDemand&) {}
  OnDemand& operator=(const OnDemand&) = delete;

  /// Calls make(value) unless that was done for this number, which no other state has.
  template <typename Make>
  const T& current(std::uint64_t number, Make&& make) {
    if (number_.load(std::memory_order_acquire) == number) return value_;
    const std::lock_guard<std::mutex> lock(making_);
    if (number_.load(std::memory_order_relaxed) == number) return value_;
    make(value_);
    number_.store(number, std::memory_order_release);
    return value_;
  }

  std::size_t bytes() const { return value_.bytes(); }

 private:
  std::atomic<std::uint64_t> number_{0};
  std::mutex making_;
  T value_;
};

}  // namespace adaptive_bvh
