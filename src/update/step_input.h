#pragma once

#include <cstddef>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The two ways FCL brings in new positions: replace*, and update*, which keeps those of the step
/// before: volumes then hold both frames.
enum class StepKind { Replace, TwoFrames };

/// The new positions of a step.
template <typename S>
struct StepInput {
  StepKind kind = StepKind::Replace;
  const fcl::Vector3<S>* positions = nullptr;  ///< not in the model's own arrays
  std::size_t count = 0;
  const unsigned* indices = nullptr;  ///< whose positions they are; null: every vertex's, in order
};

}  // namespace adaptive_bvh
