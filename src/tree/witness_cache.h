#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace adaptive_bvh {

/// The pair of triangles that a model's last query against another found nearest, for the first
/// bound of the next one. A hint: any pair of triangles will do, so collisions between partners and
/// races between threads cost time, never the answer.
class WitnessCache {
 public:
  struct Pair {
    unsigned first, second;
    bool are_near = false;  ///< see PairSearch::fromRoots
  };

  WitnessCache() = default;
  WitnessCache(const WitnessCache&) {}
  WitnessCache& operator=(const WitnessCache&) = delete;

  Pair recall(const void* partner) const {
    const std::uint64_t packed = slotOf(partner).load(std::memory_order_relaxed);
    return {static_cast<unsigned>(packed >> 32), static_cast<unsigned>(packed) & ~kNear,
            (packed & kNear) != 0};
  }
  void keep(const void* partner, Pair pair) {
    const unsigned second = pair.second | (pair.are_near ? kNear : 0);
    slotOf(partner).store(std::uint64_t(pair.first) << 32 | second, std::memory_order_relaxed);
  }

 private:
  using Slot = std::atomic<std::uint64_t>;
  static constexpr int kBits = 3;
  static constexpr unsigned kNear = 1u << 31;  // no triangle has so large an index

  const Slot& slotOf(const void* partner) const {
    const auto address = reinterpret_cast<std::uintptr_t>(partner);
    return slots_[(std::uint64_t(address) * 0x9E3779B97F4A7C15u) >> (64 - kBits)];
  }
  Slot& slotOf(const void* partner) {
    return const_cast<Slot&>(const_cast<const WitnessCache*>(this)->slotOf(partner));
  }

  std::array<Slot, 1 << kBits> slots_ = {};
};

}  // namespace adaptive_bvh
