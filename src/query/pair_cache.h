#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "query/distance_visitor.h"
#include "query/rigid_motion.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

/// Where the searches of one pair of models stopped, kept over steps, and whether it pays to begin
/// there (generalized front tracking; Ehmann and Lin 2001).
///
/// A front only grows finer. When motions are large against the distance, most of its bounds no
/// longer prune after one step, and a search from the roots is cheaper. So the costs of the last
/// search of either kind are compared. After a front that cost more, the next search leaves none;
/// after another, the next 3, then 7, up to kLongestPause.
template <typename BV>
class Front {
 public:
  using S = typename BV::S;

  /// Before a search: adds how the transforms changed since the last one.
  void moveTo(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second);
  /// For the visitor of that search.
  FrontSink sink() { return {pause_left_ > 0 ? nullptr : &next_, rigid_.sum()}; }
  /// Searches from the front, or from the roots.
  void search(DistanceVisitor<BV>& visitor);
  /// After it.
  void finish(const DistanceVisitor<BV>& visitor);

  void clear() { pairs_.clear(); }
  std::size_t size() const { return pairs_.size(); }
  std::size_t bytes() const { return (pairs_.capacity() + next_.capacity()) * sizeof(FrontPair); }

 private:
  /// Cost of checking a pair of the front, in tests of boxes.
  static constexpr double kCheck = 0.4;
  static constexpr int kLongestPause = 15;

  RigidMotion<S> rigid_;
  std::uint64_t generations_[2] = {0, 0};
  std::vector<FrontPair> pairs_, next_;
  double cost_from_roots_ = 0;      // of the last search from the roots
  int pause_ = 0, pause_left_ = 0;  // searches from the roots that leave no front
};

/// What is kept of a pair of models between two distance queries.
template <typename BV>
struct PairCache {
  /// The two triangles that were nearest last: their distance is a first upper bound.
  int witness1 = 0, witness2 = 0;
  std::optional<Front<BV>> front;
};

/// The exact distance by the boxes of both models, which both must have. False when the objects lie
/// too far apart for that, and nothing was done.
template <typename BV>
bool distanceByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                     const DistanceQuery<typename BV::S>& query, PairCache<BV>& cache);

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class Front<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
