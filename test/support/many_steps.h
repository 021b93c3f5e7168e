#pragma once

#include <cstdlib>

namespace adaptive_bvh_test {

/// So many steps, or ten times as many where the environment variable ADAPTIVE_BVH_LONG_TESTS is
/// set.
inline int manySteps(int steps) {
  return std::getenv("ADAPTIVE_BVH_LONG_TESTS") ? 10 * steps : steps;
}

}  // namespace adaptive_bvh_test
