#include "support/heap_peak.h"

#include <malloc.h>

#include <cstdlib>
#include <new>

namespace adaptive_bvh_test {

std::atomic<long> heap_bytes{0}, largest_heap_bytes{0};

namespace {

void* allocate(std::size_t size) {
  void* const block = std::malloc(size == 0 ? 1 : size);
  if (!block) throw std::bad_alloc();
  const long now = heap_bytes += long(malloc_usable_size(block));
  for (long seen = largest_heap_bytes;
       seen < now && !largest_heap_bytes.compare_exchange_weak(seen, now);) {
  }
  return block;
}

void release(void* block) {
  if (block) heap_bytes -= long(malloc_usable_size(block));
  std::free(block);
}

}  // namespace
}  // namespace adaptive_bvh_test

void* operator new(std::size_t size) { return adaptive_bvh_test::allocate(size); }
void* operator new[](std::size_t size) { return adaptive_bvh_test::allocate(size); }
void operator delete(void* p) noexcept { adaptive_bvh_test::release(p); }
void operator delete[](void* p) noexcept { adaptive_bvh_test::release(p); }
void operator delete(void* p, std::size_t) noexcept { adaptive_bvh_test::release(p); }
void operator delete[](void* p, std::size_t) noexcept { adaptive_bvh_test::release(p); }
