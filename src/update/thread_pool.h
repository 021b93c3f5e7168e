#pragma once

#include <algorithm>
#include <atomic>
#include <system_error>
#include <thread>
#include <vector>

namespace adaptive_bvh {

/// Threads for the phases of one update: the caller's and `size` - 1 more, which live as long as
/// the pool. Of size 1 it starts none.
class ThreadPool {
 public:
  /// Has fewer threads when the system gives no more.
  explicit ThreadPool(int size) {
    threads_.reserve(static_cast<std::size_t>(size) - 1);
    try {
      for (int i = 1; i < size; ++i) threads_.emplace_back([this, i] { serve(i); });
    } catch (const std::system_error&) {
    }
  }
  ~ThreadPool() {
    post(nullptr, nullptr, 0);
    for (std::thread& thread : threads_) thread.join();
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return static_cast<int>(threads_.size()) + 1; }

  /// Calls run(task, thread) for 0 <= task < count, each once, on any thread, 0 <= thread < size().
  /// Returns when all are done; what they did is then visible to the caller. `run` must not throw.
  template <typename Run>
  void forEach(int count, Run&& run) {
    if (threads_.empty()) {
      for (int task = 0; task < count; ++task) run(task, 0);
      return;
    }
    post([](void* with, int task, int thread) { (*static_cast<Run*>(with))(task, thread); }, &run,
         count);
    work(0);
    while (working_.load(std::memory_order_acquire) > 0) std::this_thread::yield();
  }

 private:
  using Call = void (*)(void* with, int task, int thread);

  /// Without a call the threads end.
  template <typename With>
  void post(Call call, With* with, int count) {
    call_ = call;
    with_ = const_cast<void*>(static_cast<const void*>(with));
    count_ = count;
    next_.store(0, std::memory_order_relaxed);
    working_.store(static_cast<int>(threads_.size()), std::memory_order_relaxed);
    round_.fetch_add(1, std::memory_order_release);
  }
  void post(std::nullptr_t, std::nullptr_t, int) { post<void>(nullptr, nullptr, 0); }

  void serve(int thread) {
    for (int round = 1;; ++round) {
      while (round_.load(std::memory_order_acquire) != round) std::this_thread::yield();
      if (!call_) return;
      work(thread);
      working_.fetch_sub(1, std::memory_order_release);
    }
  }

  void work(int thread) {
    for (int task; (task = next_.fetch_add(1, std::memory_order_relaxed)) < count_;)
      call_(with_, task, thread);
  }

  std::vector<std::thread> threads_;
  Call call_ = nullptr;
  void* with_ = nullptr;
  int count_ = 0;
  std::atomic<int> next_{0}, working_{0}, round_{0};
};

/// The end of part `i` - 1 and the beginning of part `i` of [0, size), cut in `parts`.
inline int partBegin(int size, int parts, int i) {
  return static_cast<int>(static_cast<long long>(size) * i / parts);
}

}  // namespace adaptive_bvh
