// The tasks of an update: every one once, each in a slot of its own, and done on return.
#include "base/task_pool.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace adaptive_bvh_test {
namespace task_pool_test {

using adaptive_bvh::partBegin;
using adaptive_bvh::PerThread;
using adaptive_bvh::TaskPool;

class Pool : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, Pool, testing::Values(1, 2, 3, 8));

/// Each task is called once, whatever their number beside that of the threads; what they wrote,
/// without any lock, is seen by the caller.
TEST_P(Pool, RunsEveryTaskOnce) {
  TaskPool pool(GetParam());
  EXPECT_EQ(adaptive_bvh::canRunTasks() ? GetParam() : 1, pool.size());
  for (const int count : {0, 1, 2, 7, 1000}) {
    std::vector<int> calls(std::size_t(count) + 1, 0), slot_of(std::size_t(count), -1);
    pool.forEach(count, [&](int task, int slot) {
      ++calls[std::size_t(task)];
      slot_of[std::size_t(task)] = slot;
    });
    for (int task = 0; task < count; ++task) {
      EXPECT_EQ(1, calls[std::size_t(task)]) << task;
      EXPECT_GE(slot_of[std::size_t(task)], 0);
      EXPECT_LT(slot_of[std::size_t(task)], pool.size());
    }
    EXPECT_EQ(0, calls.back());
  }
}

/// Phase after phase, each of which reads what other threads wrote in the one before.
TEST_P(Pool, EveryPhaseSeesTheOneBefore) {
  TaskPool pool(GetParam());
  constexpr int kTasks = 16;
  std::vector<int> now(kTasks, 0), next(kTasks, 0);
  for (int phase = 1; phase <= 100; ++phase) {
    pool.forEach(kTasks, [&](int task, int) {
      next[std::size_t(task)] = now[std::size_t(task + 5) % kTasks] + 1;
    });
    now.swap(next);
    for (const int value : now) ASSERT_EQ(phase, value);
  }
}

/// Two tasks in the same slot never run at once, so that what is kept by slot needs no lock.
TEST_P(Pool, SumsBySlotLoseNothing) {
  TaskPool pool(GetParam());
  PerThread<long> sums(pool.size());
  pool.forEach(20000, [&](int task, int slot) { sums[slot] += task; });
  EXPECT_EQ(20000L * 19999 / 2, sums.sum([](long& all, long some) { all += some; }));
}

/// From many threads at once, each with its own pool.
TEST_P(Pool, ServesManyCallers) {
  std::vector<long> sums(4, 0);
  std::vector<std::thread> callers;
  for (long& sum : sums)
    callers.emplace_back([&sum] {
      const TaskPool pool(GetParam());
      for (int round = 0; round < 50; ++round) {
        PerThread<long> parts(pool.size());
        pool.forEach(30, [&](int task, int slot) { parts[slot] += task; });
        sum += parts.sum([](long& all, long some) { all += some; });
      }
    });
  for (std::thread& caller : callers) caller.join();
  for (const long sum : sums) EXPECT_EQ(50 * 30 * 29 / 2, sum);
}

/// A pool of one is the caller, who takes the tasks in order.
TEST(PoolOfOne, IsTheCaller) {
  TaskPool pool(1);
  const std::thread::id caller = std::this_thread::get_id();
  std::vector<int> order;
  pool.forEach(5, [&](int task, int slot) {
    EXPECT_EQ(caller, std::this_thread::get_id());
    EXPECT_EQ(0, slot);
    order.push_back(task);
  });
  EXPECT_EQ((std::vector<int>{0, 1, 2, 3, 4}), order);
}

/// Parts cover a range without gaps, each as large as any other but for one; also of ranges whose
/// product with the parts exceeds an int, and of fewer items than parts.
TEST(Parts, AreEvenAndCoverTheRange) {
  for (const int size : {0, 1, 5, 511, 512, 1000, 2000000000})
    for (const int parts : {1, 2, 3, 8, 512}) {
      EXPECT_EQ(0, partBegin(size, parts, 0));
      EXPECT_EQ(size, partBegin(size, parts, parts));
      for (int i = 0; i < parts; ++i) {
        const int length = partBegin(size, parts, i + 1) - partBegin(size, parts, i);
        ASSERT_GE(length, size / parts);
        ASSERT_LE(length, size / parts + 1);
      }
    }
}

}  // namespace task_pool_test
}  // namespace adaptive_bvh_test
