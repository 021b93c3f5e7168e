#pragma once

#include <memory>

#include <fcl/geometry/bvh/detail/BV_fitter_base.h>
#include <fcl/geometry/bvh/detail/BV_splitter_base.h>

#include "adaptive_bvh/hierarchy.h"

namespace adaptive_bvh {

/// The splitter that a model hands to FCL (`bv_splitter`), so that FCL's build makes our tree.
///
/// FCL shares it with the copies that fcl::collide makes of a const model, one per calling thread,
/// and drives it as set() ... clear(): state in the object itself crashes plain FCL there. Ours
/// keeps it per thread, so one splitter of each kind serves all models and threads.
template <typename BV>
std::shared_ptr<fcl::detail::BVSplitterBase<BV>> sharedSplitter(HierarchyStrategy strategy);

/// The fitter that a model hands to FCL (`bv_fitter`), so that every tree FCL builds or refits for
/// us has our sound volumes. Shared by all models and threads, as the splitter is and for the same
/// reason (see thesis/fcl_build.h).
template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter();

}  // namespace adaptive_bvh
