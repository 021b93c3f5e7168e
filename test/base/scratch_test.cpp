// The memory of a build: blocks on a stack of the thread, and from the heap.
#include "base/scratch.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "support/long_mode.h"

namespace adaptive_bvh_test {
namespace scratch_test {

using adaptive_bvh::Scratch;

/// Blocks of many sizes, more than fit at times, dropped in any order: each keeps what was written.
TEST(ScratchMemory, GivesEveryBlockItsOwn) {
  std::mt19937 random(testSeed(4));
  std::vector<Scratch<unsigned>> blocks(40);
  for (unsigned round = 0; round < 20000; ++round) {
    Scratch<unsigned>& block = blocks[random() % blocks.size()];
    for (unsigned number : block) ASSERT_EQ(block[0], number);
    Scratch<unsigned>(round % 100 == 0 ? 20000 : random() % 1500, round).swap(block);
    ASSERT_EQ(0u, reinterpret_cast<std::uintptr_t>(block.data()) % alignof(std::max_align_t));
    if (round % 1000 == 0) std::vector<Scratch<unsigned>>(blocks.size()).swap(blocks);
  }
}

}  // namespace scratch_test
}  // namespace adaptive_bvh_test
