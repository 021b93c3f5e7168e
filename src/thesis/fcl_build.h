#pragma once

#include <memory>

#include <fcl/geometry/bvh/detail/BV_fitter_base.h>
#include <fcl/geometry/bvh/detail/BV_splitter_base.h>

#include "adaptive_bvh/hierarchy.h"

namespace adaptive_bvh {

/// The splitter that a model passes to FCL (`bv_splitter`), so that FCL's build produces our tree.
///
/// FCL shares the splitter with the copies that fcl::collide makes of a const model, one per
/// calling thread, and calls set() ... clear() on it for each: plain FCL's splitter, which has its
/// state in the object, crashes there. Ours stores its state per thread, so one splitter of each
/// kind serves all models and threads.
template <typename BV>
std::shared_ptr<fcl::detail::BVSplitterBase<BV>> sharedSplitter(HierarchyStrategy strategy);

/// The fitter that a model passes to FCL (`bv_fitter`), so that every tree that FCL builds or
/// refits has our conservative volumes. Shared like the splitter.
template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter();

}  // namespace adaptive_bvh
