#pragma once

#include "adaptive_bvh/query.h"

#include <fcl/geometry/bvh/BVH_model.h>

#include "query/recording_node.h"

namespace adaptive_bvh {

/// Recorded mesh-shape queries; the mesh is the first object, as FCL orders the pair. The solver is
/// the one that the request names, set up as FCL does.
template <typename S>
S meshShapeDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                    const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                    const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                    const Recorder& recorder);

template <typename S>
std::size_t meshShapeCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                             const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                             const fcl::CollisionRequest<S>& request,
                             fcl::CollisionResult<S>& result, const Recorder& recorder);

/// The same with a solver of the caller's, one of FCL's two.
template <typename S, typename Solver>
std::size_t meshShapeCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                             const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                             const Solver& solver, const fcl::CollisionRequest<S>& request,
                             fcl::CollisionResult<S>& result, const Recorder& recorder);

}  // namespace adaptive_bvh
