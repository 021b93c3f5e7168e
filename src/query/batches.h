#pragma once

#include <algorithm>
#include <cstddef>

#include "threads/task_pool.h"

namespace adaptive_bvh {

/// Calls run(begin, end) for all of [0, count) in parts, on so many threads. `run`: see
/// TaskPool::forEach.
template <typename Run>
void forEachBatch(int threads, std::size_t count, Run&& run) {
  constexpr std::size_t kBatch = 512;
  const TaskPool pool(count > 2 * kBatch ? threads : 1);
  if (pool.size() == 1) return run(std::size_t(0), count);
  pool.forEach(static_cast<int>((count + kBatch - 1) / kBatch), [&](int task, int) {
    const std::size_t begin = static_cast<std::size_t>(task) * kBatch;
    run(begin, std::min(begin + kBatch, count));
  });
}

}  // namespace adaptive_bvh
