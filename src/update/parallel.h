#pragma once

#include "update/refit.h"
#include "update/staging.h"
#include "update/stopwatch.h"

namespace adaptive_bvh {

/// From so many primitives on, threads pay.
constexpr int kParallelPrimitives = 50000;

/// What `advance` does with boxes, on several threads: staging, propagation and refits. Gives the
/// same bits. Returns the largest displacement; stops after staging when that is not finite.
template <typename BV>
typename BV::S stagePropagateRefit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree,
                                   const RefitPolicy& policy,
                                   const fcl::Vector3<typename BV::S>* positions, int threads,
                                   Stopwatch& watch, UpdateReport& report);

}  // namespace adaptive_bvh
