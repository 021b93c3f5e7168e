#pragma once

#include <atomic>

// What new allocates, here and in the libraries. The executable needs heap_peak.cpp.
namespace adaptive_bvh_test {

/// Bytes that are allocated now, and their maximum since the last `HeapPeak` was made.
extern std::atomic<long> heap_bytes, largest_heap_bytes;

/// The largest number of bytes that were allocated at once, above those at the beginning.
class HeapPeak {
 public:
  HeapPeak() : before_(heap_bytes) { largest_heap_bytes = before_; }
  long bytes() const { return largest_heap_bytes - before_; }

 private:
  long before_;
};

}  // namespace adaptive_bvh_test
