#pragma once

#include <array>
#include <limits>
#include <vector>

#include "geometry/triangle_separation.h"
#include "query/box_pair.h"
#include "query/placed_mesh.h"
#include "volume/each_volume.h"
#include "volume/volume_separation.h"

namespace adaptive_bvh {

/// A pair of nodes where a search stopped: a lower bound of their distance, and the three sums of
/// motion as they stood then (MotionBounds of either model, RigidMotion). The bound less what has
/// been added to these sums bounds the distance in a later step. They are kept apart: in one sum,
/// small steps of one would be lost beside the size of another.
struct FrontPair {
  int node1, node2;
  float motion1, motion2;  ///< accumulated, in body units
  double rigid;
  double bound;
};

/// The exact distance of two meshes, as a visitor of searchPairs: branch and bound, the nearest
/// pair first, on the boxes beside FCL's volumes, and with a cheap bound before each distance of
/// two triangles. Fills the result as FCL's query does, by FCL's triangle distances.
template <typename BV>
class DistanceVisitor {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;

  struct Pair {
    int node1, node2;
    float gap;                                           ///< of the boxes: see BoxPair
    S separation = std::numeric_limits<S>::quiet_NaN();  ///< of the volumes; NaN: not computed
  };

  /// Both meshes must have boxes. `rigid_motion`: RigidMotion::sum, of a query with a front.
  DistanceVisitor(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                  const DistanceQuery<S>& query, double rigid_motion = 0);

  /// False when the objects are so far apart, for their sizes, that single precision will not do.
  bool isPossible() const { return boxes_.isPrecise(); }
  /// The distance of two triangles as a first upper bound. Nothing when one of them does not exist.
  void addWitness(int triangle1, int triangle2);
  /// From now on, adds one in `every` of the pairs at which a search stops to `pairs`.
  void keepStops(std::vector<FrontPair>& pairs, std::size_t every) {
    stops_ = &pairs;
    every_ = until_kept_ = every;
  }
  /// Searches everything below two nodes.
  void search(int node1, int node2);

  /// True: nothing below a pair of an earlier front is nearer than the limit. The sums are rounded
  /// up, so every motion shows in a difference. Each difference is rounded once, relative to
  /// itself; 16 epsilon cover that and the sums here. When nothing moved, nothing is rounded, and
  /// the bound is compared as it is: between parallel faces many bounds equal the limit.
  bool isStillPruned(const FrontPair& pair) const {
    const double lost =
        (double(motion1_.accumulatedMotion(pair.node1)) - double(pair.motion1)) * unit1_ +
        (double(motion2_.accumulatedMotion(pair.node2)) - double(pair.motion2)) * unit2_ +
        (rigid_motion_ - pair.rigid);
    const auto limit = static_cast<double>(limit_);
    if (lost == 0) return pair.bound >= limit;
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return pair.bound >= (limit + lost) * (1 + kRounding) + rounding::tiny<double>();
  }

  // For searchPairs.
  bool prune(Pair& pair);
  bool isLeafPair(const Pair& pair) const {
    return nodes1_.isLeaf(pair.node1) && nodes2_.isLeaf(pair.node2);
  }
  void testLeaves(const Pair& pair);
  std::array<Pair, 2> split(const Pair& pair);
  /// The distance is 0: nothing can be nearer.
  bool isDone() const { return result_.min_distance <= 0; }

  /// To be called after the search. Counts it as a recorded query of both models. Returns whether
  /// it found a smaller distance than `result` came with.
  bool finish();
  /// Cost of the search so far, in tests of boxes.
  double cost() const {
    return double(work_.box_tests) + 3 * double(work_.separation_tests) +
           5 * double(work_.leaf_tests);
  }

 private:
  /// Volumes are tested when the squared gap of the boxes is at least this share of the gap that
  /// prunes, and more than kFew triangles are below: with fewer it is as fast to split.
  static constexpr float kNear = 0.25f;
  static constexpr int kFew = 8;

  Pair pairOf(int node1, int node2);
  std::array<Pair, 2> splitFirst(const Pair& pair);
  std::array<Pair, 2> splitSecond(const Pair& pair);
  ADAPTIVE_BVH_INLINE std::array<Pair, 2> nearestFirst(const Pair& parent,
                                                       TraversalStatistics* split_side,
                                                       int split_node, const Pair& a,
                                                       const Pair& b);
  void improve(S distance, int triangle1, int triangle2, const Point& on1, const Point& on2);
  void setLimit();
  /// `bound()` bounds the distance below the pair.
  template <typename Bound>
  void stop(const Pair& pair, const Bound& bound) {
    if (--until_kept_ > 0) return;
    until_kept_ = every_;
    stops_->push_back({pair.node1, pair.node2, motion1_.accumulatedMotion(pair.node1),
                       motion2_.accumulatedMotion(pair.node2), rigid_motion_, double(bound())});
  }

  const PlacedMesh<BV> first_, second_;
  const BoxNodes<const BoxNode> nodes1_, nodes2_;
  const MotionBounds<S>&motion1_, &motion2_;
  const fcl::DistanceRequest<S>& request_;
  fcl::DistanceResult<S>& result_;
  const double rigid_motion_;
  std::vector<FrontPair>* stops_ = nullptr;
  std::size_t every_ = std::numeric_limits<std::size_t>::max(), until_kept_ = every_;  // never
  const PairStatistics statistics_;
  const double unit1_, unit2_;  // of the models, per unit of their boxes
  const BoxPair boxes_;
  TriangleSeparation<S> triangles_;
  /// FCL's volumes may be read: none waits to be brought up to date.
  const bool has_volumes_;
  const VolumeSeparation<BV> volumes_;
  S limit_;           // distances from here on do not matter
  float limit2_ = 0;  // as a squared gap of boxes: see BoxPair
  bool improved_ = false;
  QueryWork work_;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class DistanceVisitor<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
