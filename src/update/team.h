#pragma once

#include <atomic>
#include <system_error>
#include <thread>
#include <vector>

namespace adaptive_bvh {

/// Threads that go through the phases of one piece of work together: the caller's and `size` - 1
/// more, which live as long as the work.
class Team {
 public:
  explicit Team(int size) : size_(size) {}

  int size() const { return size_; }

  /// Calls work(member) on every thread, 0 <= member < size; the caller's is member 0. `work` must
  /// not throw. Does with fewer threads where the system gives no more.
  template <typename Work>
  void run(Work&& work) {
    std::vector<std::thread> others;
    others.reserve(static_cast<std::size_t>(size_) - 1);
    // Nobody starts before it is known how many there are.
    std::atomic<int> known_size{0};
    const auto start = [&](int member) {
      while (known_size.load(std::memory_order_acquire) == 0) std::this_thread::yield();
      work(member);
    };
    try {
      for (int member = 1; member < size_; ++member) others.emplace_back(start, member);
    } catch (const std::system_error&) {
      size_ = static_cast<int>(others.size()) + 1;
    }
    known_size.store(size_, std::memory_order_release);
    work(0);
    for (std::thread& other : others) other.join();
  }

  /// Waits until every member is here. What they did before is then visible to all.
  void meet() {
    const int round = round_.load(std::memory_order_acquire);
    if (arrived_.fetch_add(1, std::memory_order_acq_rel) + 1 == size_) {
      arrived_.store(0, std::memory_order_relaxed);
      round_.store(round + 1, std::memory_order_release);
      return;
    }
    while (round_.load(std::memory_order_acquire) == round) std::this_thread::yield();
  }

 private:
  int size_;
  std::atomic<int> arrived_{0}, round_{0};
};

/// Numbers 0 .. count - 1, each given to whoever asks next.
class TaskList {
 public:
  explicit TaskList(int count) : count_(count) {}
  /// -1 when there are no more.
  int next() {
    const int task = next_.fetch_add(1, std::memory_order_relaxed);
    return task < count_ ? task : -1;
  }

 private:
  const int count_;
  std::atomic<int> next_{0};
};

}  // namespace adaptive_bvh
