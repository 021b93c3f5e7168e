#pragma once

#include "adaptive_bvh/query.h"

#include <fcl/geometry/bvh/BVH_model.h>

#include "query/boxed_distance.h"
#include "query/recording_node.h"

namespace adaptive_bvh {

/// The distance by the boxes of both models, which both must have. False when the objects lie too
/// far apart for that, and nothing was done.
template <typename S>
bool boxedMeshDistance(const BoxedMesh<S>& first, const BoxedMesh<S>& second,
                       const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);

/// Recorded mesh-mesh queries. Both models must have triangles.
template <typename S>
S meshMeshDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh1, const fcl::Transform3<S>& tf1,
                   const fcl::BVHModel<fcl::RSS<S>>& mesh2, const fcl::Transform3<S>& tf2,
                   const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                   const Recorder& recorder);

template <typename S>
std::size_t meshMeshCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh1, const fcl::Transform3<S>& tf1,
                            const fcl::BVHModel<fcl::RSS<S>>& mesh2, const fcl::Transform3<S>& tf2,
                            const fcl::CollisionRequest<S>& request,
                            fcl::CollisionResult<S>& result, const Recorder& recorder);

}  // namespace adaptive_bvh
