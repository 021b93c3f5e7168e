#pragma once

// Programs with allocations.cpp count what operator new is asked for, and may let it fail.
namespace adaptive_bvh_test {

/// How many allocations there were, on all threads.
long allocationCount();

/// While it lives, the allocation of a number, counted from 1 on, fails: on whichever thread.
class FailingAllocation {
 public:
  explicit FailingAllocation(long number);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;

  /// Whether there were so many.
  static bool wasReached();
};

}  // namespace adaptive_bvh_test
