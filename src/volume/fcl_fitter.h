#pragma once

#include <memory>

#include <fcl/geometry/bvh/detail/BV_fitter_base.h>

namespace adaptive_bvh {

/// The fitter that a model hands to FCL (`bv_fitter`), so that every tree FCL builds or refits for
/// us has our sound volumes. Shared by all models and threads, as the splitter is and for the same
/// reason (see hierarchy/splitter.h).
template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter();

}  // namespace adaptive_bvh
