#pragma once

#include <algorithm>
#include <limits>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>

#include "contact_method.h"

namespace adaptive_bvh_bench {

/// Every pair that touches, without points and normals.
inline fcl::CollisionRequestd allContacts() {
  return fcl::CollisionRequestd(std::numeric_limits<int>::max());
}

/// Sorted, each once.
inline std::vector<TrianglePair> sorted(std::vector<TrianglePair> pairs, bool is_self) {
  if (is_self)
    for (TrianglePair& pair : pairs)
      if (pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

inline std::vector<TrianglePair> pairsOf(const fcl::CollisionResultd& result, bool is_self) {
  std::vector<TrianglePair> pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i) {
    const fcl::Contactd& contact = result.getContact(i);
    pairs.emplace_back(unsigned(contact.b1), unsigned(contact.b2));
  }
  return sorted(std::move(pairs), is_self);
}

}  // namespace adaptive_bvh_bench
