#pragma once

#include <array>
#include <vector>

#include "tree/topology.h"
#include "volume/rss.h"

namespace adaptive_bvh {

/// What the thesis's propagation keeps beside FCL's nodes (4.2), as arrays in FCL's orders. A
/// node's current radius is the one in FCL's node. A primitive is a triangle, or a point in a point
/// cloud.
template <typename BV>
struct Tracking {
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;

  // Per node. FCL numbers children after their parent.
  std::vector<S> original_radius;  ///< radius when the node was last refitted

  // Per primitive.
  std::vector<S> latest;   ///< largest displacement of its corners in the last frame
  std::vector<S> overall;  ///< the same since its leaf was last refitted
  std::vector<std::array<Point, 3>> reference;  ///< its corners when its leaf was last refitted

  // Per vertex.
  std::vector<S> vertex_motion;  ///< displacement in the last frame

  std::vector<S> pending;  ///< the stack of the sweep

  /// Takes over the tree as it stands: volumes, order and positions become the reference state.
  void adopt(const fcl::BVHModel<BV>& model, const Topology& topology);

  /// The leaf of `primitive` was just fitted to the present positions.
  void resetPrimitive(const MeshView<S>& mesh, unsigned primitive);

  /// Bytes held by the arrays.
  std::size_t bytes() const;
};

extern template struct Tracking<fcl::RSS<float>>;
extern template struct Tracking<fcl::RSS<double>>;

}  // namespace adaptive_bvh
