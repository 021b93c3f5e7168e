#pragma once

#include <mutex>

#include "tree/evidence.h"
#include "tree/seal.h"
#include "tree/tracking.h"

namespace adaptive_bvh {

/// What stands beside FCL's tree of one model: where its volumes came from, what queries saw of it,
/// and whether it is still the tree that we left.
template <typename BV>
struct AdaptiveTree {
  AdaptiveTree() = default;
  AdaptiveTree(const AdaptiveTree& other)
      : tracking(other.tracking), evidence(other.evidence), seal(other.seal) {}

  Tracking<BV> tracking;
  Evidence<typename BV::S> evidence;
  Seal<BV> seal;
  std::mutex repairing;  ///< held by the one thread that repairs a broken seal

  std::size_t bytes() const { return tracking.bytes() + evidence.bytes(); }
};

}  // namespace adaptive_bvh
