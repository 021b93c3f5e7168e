// The threads of an update: every task once, on a thread of the pool, and done on return.
#include "update/thread_pool.h"

#include <gtest/gtest.h>

#include <set>

#include "update/step_scope.h"

namespace adaptive_bvh_test {
namespace {

using adaptive_bvh::partBegin;
using adaptive_bvh::PerThread;
using adaptive_bvh::ThreadPool;

class Pool : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, Pool, testing::Values(1, 2, 3, 8));

/// Each task is called once, whatever their number beside that of the threads; what they wrote,
/// without any lock, is seen by the caller.
TEST_P(Pool, RunsEveryTaskOnce) {
  ThreadPool pool(GetParam());
  EXPECT_EQ(GetParam(), pool.size());
  for (const int count : {0, 1, 2, 7, 1000}) {
    std::vector<int> calls(std::size_t(count) + 1, 0), thread_of(std::size_t(count), -1);
    pool.forEach(count, [&](int task, int thread) {
      ++calls[std::size_t(task)];
      thread_of[std::size_t(task)] = thread;
    });
    for (int task = 0; task < count; ++task) {
      EXPECT_EQ(1, calls[std::size_t(task)]) << task;
      EXPECT_GE(thread_of[std::size_t(task)], 0);
      EXPECT_LT(thread_of[std::size_t(task)], pool.size());
    }
    EXPECT_EQ(0, calls.back());
  }
}

/// Phase after phase, each of which reads what other threads wrote in the one before.
TEST_P(Pool, EveryPhaseSeesTheOneBefore) {
  ThreadPool pool(GetParam());
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

/// Thread numbers tell threads apart: two tasks with the same number never run at once, so that
/// what is kept by thread needs no lock.
TEST_P(Pool, SumsByThreadLoseNothing) {
  ThreadPool pool(GetParam());
  PerThread<long> sums(pool.size());
  pool.forEach(20000, [&](int task, int thread) { sums[thread] += task; });
  EXPECT_EQ(20000L * 19999 / 2, sums.sum([](long& all, long some) { all += some; }));
}

/// Pools come and go, used or not, without a thread left over or waited for in vain.
TEST_P(Pool, EndsAtAnyTime) {
  for (int round = 0; round < 50; ++round) {
    ThreadPool pool(GetParam());
    if (round % 2) pool.forEach(3, [](int, int) {});
  }
}

/// A pool of one is the caller, who takes the tasks in order.
TEST(PoolOfOne, IsTheCaller) {
  ThreadPool pool(1);
  const std::thread::id caller = std::this_thread::get_id();
  std::vector<int> order;
  pool.forEach(5, [&](int task, int thread) {
    EXPECT_EQ(caller, std::this_thread::get_id());
    EXPECT_EQ(0, thread);
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

}  // namespace
}  // namespace adaptive_bvh_test
