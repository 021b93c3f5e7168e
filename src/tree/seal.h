#pragma once

#include <cmath>
#include <cstring>
#include <limits>

#include "volume/rss.h"

namespace adaptive_bvh {

/// Tells whether FCL changed a tree behind our back. FCL's mutators are not virtual: code that
/// holds a fcl::BVHModel& can refit or rebuild the nodes (FCL's own polynomial continuous collision
/// does). Every such path rewrites the root, so the root is the seal.
///
/// Closing it raises the root's radius by one step of floating point, which is conservative. A fit
/// of the same positions that leaves all other numbers alike thus never looks like the sealed root.
///
/// `intact` may run on many threads while one of them, having found the seal broken, repairs the
/// model and closes it. The numbers are therefore written and read as atomics; the repair comes
/// first, so a thread that sees the new seal sees the repaired tree.
template <typename BV>
class Seal {
 public:
  using S = typename BV::S;
  using V = Volume<BV>;

  Seal() { breakOpen(); }

  bool intact(const BV& root) const {
    for (int i = 0; i < V::kNumbers; ++i) {
      const S a = load(number(root, i));
      const S b = load(number(copy_, i));
      if (std::memcmp(&a, &b, sizeof(S)) != 0) return false;
    }
    return true;
  }

  /// Writes `volume`, with its radius one step up, to the root and remembers it. Returns that
  /// radius.
  S close(BV& root, BV volume) {
    V::setRadius(volume, std::nextafter(V::radius(volume), std::numeric_limits<S>::infinity()));
    for (BV* target : {&copy_, &root})
      for (int i = 0; i < V::kNumbers; ++i)
        __atomic_store(&V::number(*target, i), &V::number(volume, i), __ATOMIC_RELEASE);
    return V::radius(volume);
  }

  /// From now on no root is intact.
  void breakOpen() { V::setRadius(copy_, std::numeric_limits<S>::quiet_NaN()); }

 private:
  static const S& number(const BV& bv, int i) { return V::number(const_cast<BV&>(bv), i); }
  static S load(const S& source) {
    S value;
    __atomic_load(&source, &value, __ATOMIC_ACQUIRE);
    return value;
  }

  BV copy_;
};

}  // namespace adaptive_bvh
