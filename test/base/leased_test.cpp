// Leased memory: an object for one lease at a time, kept by its thread, also after an exception.
#include "base/leased.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace adaptive_bvh_test {
namespace leased_test {

using adaptive_bvh::Leased;

/// A type of its own for each test, as the objects of a type are shared.
template <int kTest>
struct Memory {
  std::vector<int> numbers;
};

/// Takes `depth` leases one inside the other, and returns the objects.
template <typename T>
std::set<const T*> nested(int depth) {
  if (depth == 0) return {};
  const Leased<T> lease;
  std::set<const T*> objects = nested<T>(depth - 1);
  EXPECT_TRUE(objects.insert(&*lease).second) << "two leases hold one object";
  return objects;
}

TEST(LeasedMemory, NestedLeasesHoldDifferentObjects) {
  const auto first = nested<Memory<0>>(5);
  EXPECT_EQ(5u, first.size());
  EXPECT_EQ(first, nested<Memory<0>>(5)) << "the thread keeps its objects";
}

TEST(LeasedMemory, KeepsItsContents) {
  { Leased<Memory<1>>()->numbers.assign(100, 7); }
  const Leased<Memory<1>> lease;
  EXPECT_EQ(std::vector<int>(100, 7), lease->numbers);
  EXPECT_TRUE(Leased<Memory<1>>()->numbers.empty()) << "of another lease";
}

TEST(LeasedMemory, ComesBackAfterAnException) {
  const Memory<2>* object = nullptr;
  const auto fail = [&] {
    const Leased<Memory<2>> outer, inner;
    object = &*inner;
    throw std::runtime_error("from a callback");
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(1u, nested<Memory<2>>(2).count(object));
}

TEST(LeasedMemory, BelongsToItsThread) {
  const Leased<Memory<3>> here;
  const Memory<3>* there = nullptr;
  bool is_empty = false;
  here->numbers.push_back(1);
  std::thread([&] {
    const Leased<Memory<3>> lease;
    there = &*lease;
    is_empty = lease->numbers.empty();
  }).join();
  EXPECT_NE(&*here, there);
  EXPECT_TRUE(is_empty);
}

}  // namespace leased_test
}  // namespace adaptive_bvh_test
