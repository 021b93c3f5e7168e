#pragma once

#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "geometry/pack.h"

namespace adaptive_bvh {

/// By four: to copy pairs costs more than memory that is not touched.
[[gnu::noinline]] inline void growPairs(std::vector<FeaturePair>& pairs) {
  constexpr std::size_t kFirst = 256;
  pairs.reserve(4 * pairs.capacity() + kFirst);
}

/// For searches that find millions of pairs: growing stands apart, so that a pair costs little more
/// than to write it. Written in place: a pair that is put together first and then copied as a whole
/// waits for that.
ADAPTIVE_BVH_INLINE void appendPair(unsigned first, unsigned second,
                                    std::vector<FeaturePair>& pairs) {
  if (pairs.size() == pairs.capacity()) growPairs(pairs);
  FeaturePair& pair = pairs.emplace_back();
  pair.first = first;
  pair.second = second;
}

}  // namespace adaptive_bvh
