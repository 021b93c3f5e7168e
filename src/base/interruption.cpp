#include "base/interruption.h"

namespace adaptive_bvh {

std::atomic<InterruptionCheck> interruption_check{nullptr};

void setInterruptionCheck(InterruptionCheck check) noexcept {
  interruption_check.store(check, std::memory_order_relaxed);
}

}  // namespace adaptive_bvh
