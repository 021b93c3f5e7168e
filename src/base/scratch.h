#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <new>
#include <vector>

namespace adaptive_bvh {

/// A stack allocator for the temporary memory of one build: 64 KiB that each thread keeps, so that
/// building a small model does not allocate from the heap. Requests that do not fit are taken from
/// the heap.
class ScratchStack {
 public:
  static ScratchStack& ofThisThread() {
    static thread_local ScratchStack stack;
    return stack;
  }

  void* allocate(std::size_t bytes) {
    bytes = rounded(bytes);
    if (bytes > kBytes - top_) return ::operator new(bytes);
    if (!memory_) memory_.reset(new unsigned char[kBytes]);
    unsigned char* const block = memory_.get() + top_;
    top_ += bytes;
    ++blocks_;
    return block;
  }

  /// Frees a block. If the block is not on top of the stack, its memory becomes available only when
  /// all blocks have been released.
  void release(void* block, std::size_t bytes) {
    unsigned char* const first = static_cast<unsigned char*>(block);
    if (!contains(first)) return ::operator delete(block);
    const auto begin = static_cast<std::size_t>(first - memory_.get());
    if (begin + rounded(bytes) == top_) top_ = begin;
    if (--blocks_ == 0) top_ = 0;
  }

 private:
  static constexpr std::size_t kBytes = 1 << 16;

  /// A size rounded up, so that the next block is aligned for every type.
  static std::size_t rounded(std::size_t bytes) {
    constexpr std::size_t kAlign = alignof(std::max_align_t);
    return (bytes + kAlign - 1) / kAlign * kAlign;
  }
  /// Whether an address lies in the stack's memory, not in the heap.
  bool contains(const unsigned char* address) const {
    const std::less<const unsigned char*> before;
    return memory_ && !before(address, memory_.get()) && before(address, memory_.get() + kBytes);
  }

  std::unique_ptr<unsigned char[]> memory_;  ///< kBytes bytes, or null before the first request
  std::size_t top_ = 0;                      ///< number of bytes in use, counted from the bottom
  std::size_t blocks_ = 0;                   ///< number of blocks that have not been released
};

/// Allocates from the thread's ScratchStack. The allocating thread must also free the memory.
template <typename T>
struct ScratchAllocator {
  using value_type = T;

  ScratchAllocator() = default;
  template <typename U>
  ScratchAllocator(const ScratchAllocator<U>&) {}

  T* allocate(std::size_t count) {
    static_assert(alignof(T) <= alignof(std::max_align_t), "blocks are aligned no further");
    return static_cast<T*>(ScratchStack::ofThisThread().allocate(count * sizeof(T)));
  }
  void deallocate(T* block, std::size_t count) {
    ScratchStack::ofThisThread().release(block, count * sizeof(T));
  }

  friend bool operator==(const ScratchAllocator&, const ScratchAllocator&) { return true; }
  friend bool operator!=(const ScratchAllocator&, const ScratchAllocator&) { return false; }
};

/// A vector for temporary data of one build.
template <typename T>
using Scratch = std::vector<T, ScratchAllocator<T>>;

}  // namespace adaptive_bvh
