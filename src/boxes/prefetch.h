#pragma once

namespace adaptive_bvh {

/// Asks for the cache line of `at`, to write to it soon. Where another processor has read the line,
/// a thread must wait for it before it writes; a usual prefetch is for reading only.
[[gnu::always_inline]] inline void prefetchToWrite(const void* at) {
#if defined(__x86_64__)
  // By GCC only where it may suppose a newer processor. All with 64 bits know it, or skip it.
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(at)));
#else
  __builtin_prefetch(at, 1);
#endif
}

}  // namespace adaptive_bvh
