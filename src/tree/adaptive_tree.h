#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>

#include "adaptive_bvh/refit_policy.h"
#include "tree/boxes.h"
#include "tree/evidence.h"
#include "tree/incidence.h"
#include "tree/recent_pairs.h"
#include "tree/seal.h"
#include "tree/tracking.h"

namespace adaptive_bvh {

/// What stands beside FCL's tree of one model: where its volumes came from, what queries saw of it,
/// and whether it is still the tree that we left.
template <typename BV>
struct AdaptiveTree {
  using S = typename BV::S;

  AdaptiveTree() = default;
  AdaptiveTree(const AdaptiveTree& other)
      : propagation(other.propagation),
        topology(other.topology),
        displacements(other.displacements),
        boxes(other.boxes),
        incidence(other.incidence),
        evidence(other.evidence),
        seal(other.seal) {}

  Propagation propagation = Propagation::Boxes;
  /// Another number, which no other tree has, whenever travels (Boxes) or the topology begin anew.
  std::uint64_t generation = newGeneration();
  Topology topology;
  std::optional<Tracking<BV>> displacements;  ///< with Propagation::Displacements
  std::optional<Boxes<S>> boxes;              ///< with Propagation::Boxes
  Incidence incidence;                        ///< empty until it is needed
  mutable Evidence evidence;                  ///< which queries, that hold the model const, leave
  mutable RecentPairs recent;
  Seal<BV> seal;
  std::mutex repairing;  ///< held by the one thread that repairs a broken seal

  static std::uint64_t newGeneration();

  /// Begins anew at FCL's tree as it stands, with no evidence. Boxes get room, but no contents.
  void adopt(const fcl::BVHModel<BV>& model);

  /// Radius of a volume when it was last refitted.
  S originalRadius(const fcl::BVHModel<BV>& model, int node) const {
    if (displacements) return displacements->original_radius[static_cast<std::size_t>(node)];
    return std::max(S(0), Volume<BV>::radius(model.getBV(node).bv) -
                              S(boxes->inflationOf(node)) * boxes->frame.unit());
  }

  /// Lets sums over frames begin anew, before they lose digits.
  void forgetTravel(const fcl::BVHModel<BV>& model);

  /// The volume of `node` was just fitted to the present positions. `widenReach` is to follow.
  void refitted(const fcl::BVHModel<BV>& model, int node);

  /// Volumes were refitted that reach no farther than this (Boxes::reach).
  void widenReach(S reach) {
    if (boxes) boxes->reach = std::max(boxes->reach, reach);
  }

  std::size_t bytes() const {
    return topology.bytes() + (displacements ? displacements->bytes() : 0) +
           (boxes ? boxes->bytes() : 0) + incidence.bytes() + evidence.bytes();
  }
};

extern template struct AdaptiveTree<fcl::RSS<float>>;
extern template struct AdaptiveTree<fcl::RSS<double>>;

}  // namespace adaptive_bvh
