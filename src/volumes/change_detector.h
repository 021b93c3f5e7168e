#pragma once

#include <cmath>
#include <cstring>
#include <limits>

#include "volumes/volume.h"

namespace adaptive_bvh {

/// Detects that FCL changed a tree without our update. FCL's mutators are not virtual: code that
/// holds a fcl::BVHModel& can refit or rebuild the nodes (FCL's own polynomial continuous collision
/// does). Every such path rewrites the root, so the root's numbers are compared with a copy.
///
/// `record` raises the root's radius by one step of floating point, which is conservative. A fit of
/// the same positions that leaves all other numbers alike thus never looks like the recorded root.
///
/// `matches` may run on many threads while one of them, having found a change, repairs the model
/// and records it. The numbers are therefore written and read as atomics; the repair comes first,
/// so a thread that sees the new root sees the repaired tree.
template <typename BV>
class ChangeDetector {
 public:
  using S = typename BV::S;
  using V = Volume<BV>;

  /// Is this the root that was recorded last?
  bool matches(const BV& root) const {
    if (!load(recorded_)) return false;
    for (int i = 0; i < V::kNumbers; ++i) {
      const S a = load(number(root, i));
      const S b = load(number(copy_, i));
      // Bits, not values: NaN equals itself here, and 0 differs from -0.
      if (std::memcmp(&a, &b, sizeof(S)) != 0)  // NOLINT(bugprone-suspicious-memory-comparison)
        return false;
    }
    return true;
  }

  /// Writes `volume`, with its radius one step up, to the root and remembers it. Returns that
  /// radius.
  S record(BV& root, BV volume) {
    V::raiseRadius(volume);
    for (BV* target : {&copy_, &root})
      for (int i = 0; i < V::kNumbers; ++i) store(V::number(*target, i), V::number(volume, i));
    store(recorded_, true);
    return V::radius(volume);
  }

  /// From now on no root matches, until the next `record`.
  void invalidate() { store(recorded_, false); }

 private:
  static const S& number(const BV& bv, int i) { return V::number(const_cast<BV&>(bv), i); }
  template <typename T>
  static T load(const T& source) {
    T value;
    __atomic_load(&source, &value, __ATOMIC_ACQUIRE);
    return value;
  }
  template <typename T>
  static void store(T& target, T value) {
    __atomic_store(&target, &value, __ATOMIC_RELEASE);
  }

  bool recorded_ = false;
  BV copy_;
};

}  // namespace adaptive_bvh
