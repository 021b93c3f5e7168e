#pragma once

#include "tree/tracking.h"

namespace adaptive_bvh {

/// The error propagation of thesis 4.3: inflates every volume so that it surely holds its triangles
/// at their new positions. One sweep from the leaves to the root; allocates nothing.
///
/// Leaf:  current = max(current, original + D_overall)     (step 3)
///        or original + D_overall, where `leaf_radius_may_shrink`
///        D_latest = latest displacement of its triangle   (step 4)
/// Inner: D_latest = max of both children's
///        current = current + D_latest                     (step 5)
///
/// Why it holds: let p be a corner of a triangle below the node and p' where it is now. A leaf's
/// original volume held p at its reference position, |p' - p_reference| <= D_overall. An inner
/// volume held p in the frame before, |p' - p| <= D_latest. A volume is all points within its
/// radius of its rectangle, so adding the displacement to the radius reaches p', and being convex,
/// it then holds the whole triangle. Displacements and sums are rounded up (rounding.h).
///
/// Returns how many volumes changed.
template <typename BV>
int propagate(fcl::BVHModel<BV>& model, Tracking<BV>& tracking, bool leaf_radius_may_shrink);

}  // namespace adaptive_bvh
