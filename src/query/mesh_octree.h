#pragma once

#include "adaptive_bvh/query.h"

#include <fcl/geometry/bvh/BVH_model.h>

#include "query/recorder.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and an octree. FCL's own traversal of such a pair runs inside its
/// octree solver and cannot be watched; these visit pairs of a cell and a node likewise, and ask
/// FCL's solver about a cell and a triangle. In the result the octree is the first object, as FCL
/// has it for both orders. Throw std::logic_error where FCL was built without octomap, and so
/// nobody can have made an octree.
template <typename S>
S meshOctreeDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& mesh_tf,
                     const fcl::CollisionGeometry<S>& octree, const fcl::Transform3<S>& octree_tf,
                     const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                     const Recorder& recorder);

/// Not for requests with costs, which also count cells of unknown state.
template <typename S>
std::size_t meshOctreeCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh,
                              const fcl::Transform3<S>& mesh_tf,
                              const fcl::CollisionGeometry<S>& octree,
                              const fcl::Transform3<S>& octree_tf,
                              const fcl::CollisionRequest<S>& request,
                              fcl::CollisionResult<S>& result, const Recorder& recorder);

}  // namespace adaptive_bvh
