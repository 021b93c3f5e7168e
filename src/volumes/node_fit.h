#pragma once

#include "volumes/update_target.h"

namespace adaptive_bvh {

/// The volume around a node's triangles as they stand.
template <typename BV>
BV fitNode(const UpdateTarget<BV>& target, int node);

/// Recomputes every volume in place but the root's. That fit is returned, for the change detector
/// to write last: queries on other threads may be reading the root meanwhile.
template <typename BV>
BV refitAllButRoot(const UpdateTarget<BV>& target);

}  // namespace adaptive_bvh
