#include "base/shortcut.h"

#ifdef ADAPTIVE_BVH_SHORTCUT_TESTS

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

namespace adaptive_bvh {
namespace {

constexpr auto kShortcuts = static_cast<std::size_t>(Shortcut::kCount);
constexpr auto kDecisions = static_cast<std::size_t>(ExactDecision::kCount);
constexpr const char* kShortcutNames[kShortcuts] = {
    "Supports",  "FlatPatches", "SinglePrecision", "Avx2",
    "Coherence", "Alignment",   "Threads",         "RoundedPredicates"};
constexpr const char* kDecisionNames[kDecisions] = {"Orientation",       "TriangleSides",
                                                    "PlanarOrientation", "RayTriangle",
                                                    "CrossingParameter", "BoundaryAngle"};

/// Whether each shortcut is taken.
class Taken {
 public:
  Taken() {
    for (auto& taken : taken_) taken = true;
    const char* without = std::getenv("ADAPTIVE_BVH_WITHOUT");
    if (!without || !*without) return;
    for (std::size_t i = 0; i < kShortcuts; ++i)
      if (std::strcmp(without, kShortcutNames[i]) == 0) {
        taken_[i] = false;
        return;
      }
    throw std::invalid_argument(std::string("ADAPTIVE_BVH_WITHOUT: no shortcut ") + without);
  }
  std::atomic<bool>& operator[](Shortcut shortcut) {
    return taken_[static_cast<std::size_t>(shortcut)];
  }

 private:
  std::array<std::atomic<bool>, kShortcuts> taken_;
};

std::atomic<bool>& taken(Shortcut shortcut) {
  static Taken all;
  return all[shortcut];
}

std::atomic<long>& counter(ExactDecision decision) {
  static std::array<std::atomic<long>, kDecisions> counters{};
  return counters[static_cast<std::size_t>(decision)];
}

}  // namespace

bool isTaken(Shortcut shortcut) { return taken(shortcut).load(std::memory_order_relaxed); }
void take(Shortcut shortcut, bool is_taken) { taken(shortcut).store(is_taken); }
const char* nameOf(Shortcut shortcut) { return kShortcutNames[static_cast<std::size_t>(shortcut)]; }

void countExact(ExactDecision decision) {
  counter(decision).fetch_add(1, std::memory_order_relaxed);
}
long exactDecisions(ExactDecision decision) { return counter(decision).load(); }
const char* nameOf(ExactDecision decision) {
  return kDecisionNames[static_cast<std::size_t>(decision)];
}

}  // namespace adaptive_bvh

#endif
