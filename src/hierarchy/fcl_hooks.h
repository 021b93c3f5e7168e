#pragma once

#include <memory>

#include <fcl/geometry/bvh/detail/BV_fitter_base.h>
#include <fcl/geometry/bvh/detail/BV_splitter_base.h>

namespace adaptive_bvh {

/// The fitter and splitter that a model hands to FCL (`bv_fitter`, `bv_splitter`), so that every
/// tree FCL builds or refits for us has our sound volumes and FCL's own mean split.
///
/// FCL shares both objects with the copies that fcl::collide makes of a const model, one per
/// calling thread, and drives them as set() ... clear(): state in the object itself crashes plain
/// FCL there. Ours keep it per thread, so one of each serves all models and threads.
template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter();

template <typename BV>
std::shared_ptr<fcl::detail::BVSplitterBase<BV>> sharedSplitter();

}  // namespace adaptive_bvh
