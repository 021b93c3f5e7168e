#pragma once

#include <atomic>

#include "adaptive_bvh/interruption.h"

namespace adaptive_bvh {

extern std::atomic<InterruptionCheck> interruption_check;  ///< set by setInterruptionCheck

inline void checkInterruption() {
  if (const InterruptionCheck check = interruption_check.load(std::memory_order_relaxed)) check();
}

}  // namespace adaptive_bvh
