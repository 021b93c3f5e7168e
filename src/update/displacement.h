#pragma once

#include "tree/tracking.h"

namespace adaptive_bvh {

/// True when every coordinate is finite and small enough for the sums of squares of a fit
/// (rounding::largestCoordinate).
template <typename S>
bool usablePositions(const fcl::Vector3<S>* positions, std::size_t count);

/// Writes `positions` (one per vertex) into the model and measures how far every vertex and every
/// primitive moved: latest and overall displacements, thesis 4.2. Every figure is rounded up.
/// Returns the largest vertex displacement; not finite when the old positions were not.
template <typename BV>
typename BV::S moveVertices(fcl::BVHModel<BV>& model, Tracking<BV>& tracking,
                            const fcl::Vector3<typename BV::S>* positions);

}  // namespace adaptive_bvh
