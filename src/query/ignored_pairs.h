#pragma once

#include <algorithm>
#include <stdexcept>

#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

/// Throws std::invalid_argument when the list is not sorted.
inline void requireSorted(const IgnoredPairs& pairs) {
  if (pairs.list && !std::is_sorted(pairs.list->begin(), pairs.list->end()))
    throw std::invalid_argument(
        "adaptive_bvh: the list of pairs to ignore is not sorted by first and second number");
}

/// Whether a pair is one of these.
inline bool isIgnored(const IgnoredPairs& pairs, unsigned first, unsigned second) {
  const FeaturePair pair{first, second};
  return (pairs.list && std::binary_search(pairs.list->begin(), pairs.list->end(), pair)) ||
         (pairs.test && pairs.test(first, second));
}

}  // namespace adaptive_bvh
