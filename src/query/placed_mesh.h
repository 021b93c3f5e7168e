#pragma once

#include <stdexcept>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>
#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "tree/adaptive_tree.h"
#include "tree/pair_statistics.h"

namespace adaptive_bvh {

/// A mesh of a query, and where it is.
template <typename BV>
struct PlacedMesh {
  using S = typename BV::S;

  const fcl::BVHModel<BV>* model = nullptr;
  const AdaptiveTree<BV>* tree = nullptr;  ///< null where the model is FCL's own
  fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();

  bool hasBoxes() const { return tree && tree->boxes; }
  TraversalStatistics* statistics() const { return tree ? &tree->statistics : nullptr; }
  /// Where visits of nodes are recorded: nowhere while FCL's volumes wait, for the next step asks
  /// no criterion.
  TraversalStatistics* visits() const {
    return tree && tree->volumesAreCurrent() ? &tree->statistics : nullptr;
  }
};

/// To be called before the boxes of an adaptive model are read, or the motion beside them: they may
/// wait since an update. Threads that query may call it at once.
template <typename BV>
void updateBoxes(const PlacedMesh<BV>& mesh);
/// As above, before FCL's volumes are read. Nothing where the model is FCL's own.
template <typename BV>
void updateVolumes(const PlacedMesh<BV>& mesh);

/// The four-wide tree of an adaptive model, up to date. It needs no boxes.
template <typename BV>
const WideTree<typename BV::S>& wideTreeOf(const PlacedMesh<BV>& mesh) {
  return mesh.tree->wide.current(*mesh.model, *mesh.tree);
}

/// The other object of a query, a shape or an octree.
template <typename S>
struct PlacedGeometry {
  const fcl::CollisionGeometry<S>* geometry;
  fcl::Transform3<S> tf;
};

template <typename BV>
PairStatistics statisticsOf(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  return {{first.statistics(), second.statistics()}};
}
template <typename BV>
PairStatistics visitsOf(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  return {{first.visits(), second.visits()}};
}
template <typename BV>
PairStatistics statisticsOf(const PlacedMesh<BV>& mesh) {
  return {{mesh.statistics(), nullptr}};
}

/// What a distance query is given.
template <typename S>
struct DistanceQuery {
  const fcl::DistanceRequest<S>& request;
  fcl::DistanceResult<S>& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// What a collision query is given.
template <typename S>
struct CollisionQuery {
  const fcl::CollisionRequest<S>& request;
  fcl::CollisionResult<S>& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// Throws std::invalid_argument where a mesh cannot be queried: FCL crashes on one without
/// triangles.
template <typename BV>
void requireTriangles(const fcl::BVHModel<BV>& mesh) {
  if (mesh.getModelType() != fcl::BVH_MODEL_TRIANGLES || mesh.getNumBVs() == 0)
    throw std::invalid_argument(
        "adaptive_bvh: a queried model has no triangles, or was not built by endModel");
}

}  // namespace adaptive_bvh
