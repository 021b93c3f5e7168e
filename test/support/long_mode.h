#pragma once

#include <cstdio>
#include <cstdlib>
#include <random>

// The longer mode of the tests; test/run.sh says how to call it.
namespace adaptive_bvh_test {

/// Whether the environment variable ADAPTIVE_BVH_LONG_TESTS is set.
inline bool isLongMode() { return std::getenv("ADAPTIVE_BVH_LONG_TESTS") != nullptr; }

/// The number of repetitions of a test: `steps`, or ten times as many in the longer mode.
inline int manySteps(int steps) { return isLongMode() ? 10 * steps : steps; }

/// The seed of this run: ADAPTIVE_BVH_TEST_SEED, or in the longer mode a fresh one, which is
/// printed. 0 means that every test has the seed that is written in its source.
inline unsigned runSeed() {
  static const unsigned seed = [] {
    if (const char* given = std::getenv("ADAPTIVE_BVH_TEST_SEED"))
      return unsigned(std::strtoul(given, nullptr, 10));
    if (!isLongMode()) return 0u;
    const unsigned fresh = std::random_device()();
    std::printf("To repeat these random numbers: ADAPTIVE_BVH_TEST_SEED=%u\n", fresh);
    return fresh;
  }();
  return seed;
}

/// The seed of a property test's random numbers: `fixed`, so that ctest repeats itself, combined
/// with the seed of this run.
inline unsigned testSeed(unsigned fixed) { return fixed ^ (runSeed() * 0x9e3779b9u); }

}  // namespace adaptive_bvh_test
