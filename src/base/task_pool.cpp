#include "base/task_pool.h"

#include "base/shortcut.h"

#ifdef ADAPTIVE_BVH_HAS_TBB
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace adaptive_bvh {

#ifdef ADAPTIVE_BVH_HAS_TBB

bool canRunTasks() { return isTaken(Shortcut::Threads); }

/// Isolated, so that the calling thread does not execute unrelated, possibly long tasks of its
/// arena while it waits for these.
void runTasks(int count, void (*call)(void* context, int i), void* context) noexcept {
  try {
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(
          tbb::blocked_range<int>(0, count),
          [&](const tbb::blocked_range<int>& range) {
            for (int i = range.begin(); i < range.end(); ++i) call(context, i);
          },
          tbb::simple_partitioner());
    });
  } catch (...) {  // oneTBB has no memory or no threads: some calls are omitted
  }
}

#else

bool canRunTasks() { return false; }

void runTasks(int, void (*)(void*, int), void*) noexcept {}

#endif

}  // namespace adaptive_bvh
