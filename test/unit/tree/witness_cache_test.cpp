// What a model remembers of its last queries against others.
#include "tree/witness_cache.h"

#include <gtest/gtest.h>

#include <set>
#include <thread>
#include <vector>

namespace adaptive_bvh_test {
namespace witness_cache_test {

using adaptive_bvh::WitnessCache;

bool isPair(const WitnessCache::Pair& pair, unsigned first, unsigned second) {
  return pair.first == first && pair.second == second;
}

/// The pair kept last for a partner; the first pair of triangles where there is none.
TEST(Witnesses, AreRecalled) {
  WitnessCache cache;
  const int partner = 0;
  EXPECT_TRUE(isPair(cache.recall(&partner), 0, 0));
  cache.keep(&partner, {7, 9});
  EXPECT_TRUE(isPair(cache.recall(&partner), 7, 9));
  EXPECT_FALSE(cache.recall(&partner).are_near);
  cache.keep(&partner, {~0u, ~0u >> 1, true});
  EXPECT_TRUE(isPair(cache.recall(&partner), ~0u, ~0u >> 1)) << "all bits of both";
  EXPECT_TRUE(cache.recall(&partner).are_near);
  EXPECT_TRUE(isPair(cache.recall(nullptr), 0, 0) || isPair(cache.recall(nullptr), ~0u, ~0u >> 1));
}

/// Partners share few slots: each recalls its own pair or, after a collision, another's, but never
/// a mixture; and several partners are told apart.
TEST(Witnesses, OfSeveralPartnersAreToldApart) {
  WitnessCache cache;
  std::vector<double> partners(1000);
  for (unsigned i = 0; i < 1000; ++i) cache.keep(&partners[i], {i, i + 5000});
  std::set<unsigned> remembered;
  for (const double& partner : partners) {
    const auto pair = cache.recall(&partner);
    ASSERT_EQ(pair.first + 5000, pair.second);
    remembered.insert(pair.first);
  }
  EXPECT_EQ(8u, remembered.size()) << "all slots are in use";
}

/// A copy of a model has asked nobody yet.
TEST(Witnesses, AreNotCopied) {
  WitnessCache cache;
  cache.keep(&cache, {3, 4});
  const WitnessCache copy(cache);
  EXPECT_TRUE(isPair(copy.recall(&cache), 0, 0));
  EXPECT_TRUE(isPair(cache.recall(&cache), 3, 4));
}

/// Kept and recalled by several threads at once, a pair is always one that was kept as a whole.
TEST(Witnesses, AreNeverTorn) {
  WitnessCache cache;
  const int partner = 0;
  cache.keep(&partner, {0, ~0u >> 1});
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (unsigned i = 0; i < 20000; ++i) {
        constexpr unsigned kAll = ~0u >> 1;
        cache.keep(&partner, {4 * i + t, ~(4 * i + t) & kAll, t % 2 == 1});
        const auto pair = cache.recall(&partner);
        ASSERT_EQ(pair.first, ~pair.second & kAll);
        ASSERT_EQ(pair.first % 2 == 1, pair.are_near);
      }
    });
  for (auto& thread : threads) thread.join();
}

}  // namespace witness_cache_test
}  // namespace adaptive_bvh_test
