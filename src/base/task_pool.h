#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <memory>
#include <vector>

namespace adaptive_bvh {

/// Whether tasks can run on other threads, that is, whether oneTBB was compiled in.
bool canRunTasks();
/// Calls call(context, i) for 0 <= i < count with oneTBB, in the caller's task arena, and returns
/// when all started calls have ended. If oneTBB cannot start tasks, some calls are omitted. A plain
/// function and its context, so that only task_pool.cpp includes oneTBB.
void runTasks(int count, void (*call)(void* context, int i), void* context) noexcept;

/// The first element of part `i`, and the end of part `i` - 1, if [0, size) is divided into `parts`
/// parts of nearly equal size.
inline int partBegin(int size, int parts, int i) {
  return static_cast<int>(static_cast<long long>(size) * i / parts);
}

/// Runs tasks in parallel on at most `size` free threads of the caller's task arena. Starts no
/// threads.
class TaskPool {
 public:
  /// The size is 1 without oneTBB. If it is above 1, the constructor allocates all that forEach
  /// needs.
  explicit TaskPool(int size)
      : size_(size > 1 && canRunTasks() ? size : 1),
        shares_(size_ > 1 ? new Share[static_cast<std::size_t>(size_)] : nullptr) {}

  int size() const { return size_; }
  /// The number of parts into which to divide uniform work: more than threads, to balance the load.
  int parts() const { return size_ > 1 ? 8 * size_ : 1; }

  /// Calls run(task, slot) once for each 0 <= task < count, on any thread, with 0 <= slot < size().
  /// Calls that run at the same time have different slots. Returns when all calls have ended; their
  /// writes are then visible to the caller. Each slot starts with a contiguous range of tasks of
  /// its own, so one processor reads the data of neighbouring tasks. After a task throws, no
  /// further task begins, and the caller gets the first exception when the running tasks have
  /// ended. forEach itself throws nothing else: if oneTBB has no memory, the caller's thread
  /// executes the remaining tasks. A task must not call forEach of the same pool.
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
      for (int i = 0; i < size_; ++i) {  // its own tasks, then the remaining tasks of other slots
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
    posted.fetch_add(1, std::memory_order_release);  // for ThreadSanitizer only
    runTasks(
        std::min(size_, count),
        [](void* context, int slot) {
          posted.load(std::memory_order_acquire);
          (*static_cast<decltype(work)*>(context))(slot);
        },
        &work);
    work(0);  // executes the tasks that no other thread has started
    finished.load(std::memory_order_acquire);
    if (failure) std::rethrow_exception(failure);
  }

  /// Divides [0, size) into `parts` and calls run(first, last, slot) for each part, as forEach
  /// does.
  template <typename Run>
  void forEachPart(int size, int parts, Run&& run) const {
    forEach(parts, [&](int part, int slot) {
      run(partBegin(size, parts, part), partBegin(size, parts, part + 1), slot);
    });
  }

 private:
  /// The tasks of a slot that no thread has started: from `next` to `end`, excluding `end`.
  struct alignas(64) Share {
    std::atomic<int> next{0};
    int end = 0;
  };

  /// ThreadSanitizer cannot see the synchronization inside oneTBB. `posted` and `finished` repeat
  /// it with atomics that ThreadSanitizer sees; their values are not used.
  static inline std::atomic<unsigned> posted{0};

  int size_;
  std::unique_ptr<Share[]> shares_;
};

/// One value for each slot of a TaskPool of this size, on separate cache lines. Only the
/// constructor allocates, and only for more than one slot.
template <typename T>
class PerThread {
 public:
  explicit PerThread(int size) : others_(static_cast<std::size_t>(size) - 1) {}
  T& operator[](int slot) {
    return slot == 0 ? first_ : others_[static_cast<std::size_t>(slot) - 1].value;
  }
  /// Combines the values of all slots: calls add(total, value) for each slot but the first, whose
  /// value `total` starts with.
  template <typename Add>
  T sum(Add&& add) {
    T total = first_;
    for (const Slot& slot : others_) add(total, slot.value);
    return total;
  }

 private:
  struct alignas(64) Slot {
    T value{};
  };
  T first_{};
  std::vector<Slot> others_;
};

}  // namespace adaptive_bvh
