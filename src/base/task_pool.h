#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <memory>
#include <vector>

namespace adaptive_bvh {

/// Whether there is something to run tasks on besides the caller: oneTBB.
bool canRunTasks();
/// Calls call(with, i) for 0 <= i < count, by oneTBB, in the caller's task arena, and returns when
/// all that began are done. Some may never begin when oneTBB cannot start.
void runTasks(int count, void (*call)(void* with, int i), void* with) noexcept;

/// The end of part `i` - 1 and the beginning of part `i` of [0, size), cut in `parts`.
inline int partBegin(int size, int parts, int i) {
  return static_cast<int>(static_cast<long long>(size) * i / parts);
}

/// The threads for the phases of an update: at most `size` free threads of the caller's task arena.
/// Starts no threads.
class TaskPool {
 public:
  /// Has size 1 without oneTBB. Allocates, if its size is above 1, all that forEach needs.
  explicit TaskPool(int size)
      : size_(size > 1 && canRunTasks() ? size : 1),
        shares_(size_ > 1 ? new Share[static_cast<std::size_t>(size_)] : nullptr) {}

  int size() const { return size_; }
  /// The number of parts for uniform work: more than threads, so that the load is balanced.
  int parts() const { return size_ > 1 ? 8 * size_ : 1; }

  /// Calls run(task, slot) for 0 <= task < count, each once, on any thread, 0 <= slot < size(): no
  /// two that have the same slot at the same time. Returns when all are done; what they did is then
  /// visible to the caller. Each slot first takes tasks of a part of its own, one after the other:
  /// what neighbouring tasks read is then read by one processor. Once a task throws, no further
  /// task begins; the caller gets the first exception when those that began are done. A `run` that
  /// throws nothing makes a forEach that throws nothing: where oneTBB has no memory, the caller's
  /// thread does what is left. A task may not call forEach of the same pool.
  template <typename Run>
  void forEach(int count, Run&& run) const {
    if (size_ == 1) {
      for (int task = 0; task < count; ++task) run(task, 0);
      return;
    }
    std::atomic<int> finished{0};
    std::atomic<bool> has_failed{false};
    std::exception_ptr failure;
    Share* const shares = shares_.get();
    for (int i = 0; i < size_; ++i) {
      Share& share = shares[i];
      share.next.store(partBegin(count, size_, i), std::memory_order_relaxed);
      share.end = partBegin(count, size_, i + 1);
    }
    auto work = [&](int slot) noexcept {
      for (int i = 0; i < size_; ++i) {  // its own, then what others have left
        Share& share = shares[(slot + i) % size_];
        for (int task; (task = share.next.fetch_add(1, std::memory_order_relaxed)) < share.end;) {
          if (has_failed.load(std::memory_order_relaxed)) continue;
          try {
            run(task, slot);
          } catch (...) {
            if (!has_failed.exchange(true)) failure = std::current_exception();
          }
        }
      }
      finished.fetch_add(1, std::memory_order_release);
    };
    posted.fetch_add(1, std::memory_order_release);
    runTasks(
        std::min(size_, count),
        [](void* with, int slot) {
          posted.load(std::memory_order_acquire);
          (*static_cast<decltype(work)*>(with))(slot);
        },
        &work);
    work(0);  // what none began
    finished.load(std::memory_order_acquire);
    if (failure) std::rethrow_exception(failure);
  }

  /// The same for `parts` parts of [0, size): calls run(first, last, slot).
  template <typename Run>
  void forEachPart(int size, int parts, Run&& run) const {
    forEach(parts, [&](int part, int slot) {
      run(partBegin(size, parts, part), partBegin(size, parts, part + 1), slot);
    });
  }

 private:
  /// The tasks of a slot, in order.
  struct alignas(64) Share {
    std::atomic<int> next{0};
    int end = 0;
  };

  /// oneTBB orders what tasks read and write. This and `finished` do so, too, where ThreadSanitizer
  /// sees it: it cannot look into oneTBB.
  static inline std::atomic<unsigned> posted{0};

  int size_;
  std::unique_ptr<Share[]> shares_;
};

/// One value for each slot of a TaskPool, on cache lines of their own. Allocates only when it is
/// made, if there is more than one.
template <typename T>
class PerThread {
 public:
  explicit PerThread(int threads) : others_(static_cast<std::size_t>(threads) - 1) {}
  T& operator[](int thread) {
    return thread == 0 ? first_ : others_[static_cast<std::size_t>(thread) - 1].value;
  }
  template <typename Add>
  T sum(Add&& add) {
    T all = first_;
    for (const Slot& slot : others_) add(all, slot.value);
    return all;
  }

 private:
  struct alignas(64) Slot {
    T value{};
  };
  T first_{};
  std::vector<Slot> others_;
};

}  // namespace adaptive_bvh
