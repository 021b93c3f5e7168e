#pragma once

#include <type_traits>
#include <utility>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>  // BVH_model.h calls fit() without declaring it
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_distance_traversal_node.h>

#include "method.h"

namespace adaptive_bvh_bench {

/// What an FCL model holds: nodes, positions, triangles, its list of primitives.
template <typename BV>
std::size_t fclBytes(const fcl::BVHModel<BV>& model) {
  return sizeof(model) + std::size_t(model.getNumBVs()) * sizeof(fcl::BVNode<BV>) +
         std::size_t(model.num_vertices) * sizeof(Point) * (model.prev_vertices ? 2 : 1) +
         std::size_t(model.num_tris) * (sizeof(fcl::Triangle) + sizeof(unsigned));
}

/// Gives an FCL model new positions and refits it top-down, the sound way.
template <typename BV>
void refitTopDown(fcl::BVHModel<BV>& model, const Positions& positions) {
  model.beginReplaceModel();
  model.replaceSubModel(positions);
  model.endReplaceModel(true, false);
}

/// One of FCL's traversals, on the models as they are, no copies. Axis-aligned boxes need both at
/// the identity.
template <typename Node, typename BV>
Work countedDistance(fcl::BVHModel<BV>& first, fcl::BVHModel<BV>& second, const Frame& frame,
                     fcl::DistanceResultd& result) {
  Node node;
  const fcl::DistanceRequestd request;
  if constexpr (std::is_same_v<Node, fcl::detail::MeshDistanceTraversalNode<BV>>) {
    fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
    fcl::detail::initialize(node, first, tf1, second, tf2, request, result);
  } else {  // oriented volumes
    fcl::detail::initialize(node, std::as_const(first), frame.tf1, std::as_const(second), frame.tf2,
                            request, result);
  }
  node.enableStatistics(true);
  fcl::detail::distance(&node);
  return {node.num_bv_tests, node.num_leaf_tests, 0};
}

}  // namespace adaptive_bvh_bench
