#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "query/pair_search.h"
#include "query/rigid_motion.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

/// Where the last search of one pair of models stopped, kept over steps, and whether it pays to
/// begin there (generalized front tracking; Ehmann and Lin 2001).
///
/// A front pays when most of its bounds still prune after a step. A sample of the pairs where the
/// last search stopped says so beforehand. A search from the roots writes no more than such a
/// sample, until two in a row promise enough (bodies may do one thing in one step and another in
/// the next); then it writes a whole front, which is used while a sample of it promises something.
/// After a front that saved less than it took to write, twice as many samples in a row must promise
/// enough.
///
/// A front only grows finer. It is written anew, by a search from the roots, when what it has cost
/// beyond its cheapest search adds up to that; and now and then, to see what one costs.
template <typename BV>
class Front {
 public:
  using S = typename BV::S;

  /// Before a search: adds how the transforms changed since the last one.
  void moveTo(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second);
  /// For that search.
  double rigidMotion() const { return rigid_.sum(); }
  /// Searches from the front, or from the roots: see PairSearch::fromRoots for `are_near`.
  void run(PairSearch<BV>& search, bool& are_near);

  void clear() {
    every_ = kSparse;
    pairs_.clear();
  }
  /// Of pairs where the next search may begin; 0 while there is but a sample.
  std::size_t size() const { return isWhole() ? pairs_.size() : 0; }
  /// They, or the sample.
  const std::vector<FrontPair>& pairs() const { return pairs_; }
  std::size_t bytes() const { return (pairs_.capacity() + added_.capacity()) * sizeof(FrontPair); }

 private:
  /// What it costs to check a pair of the front, in tests of boxes.
  static constexpr double kCheck = 0.5;
  /// A front is written for a search that promises to cost this share of one from the roots, with
  /// what it takes to write it, over so many steps.
  static constexpr double kPays = 0.8, kLasts = 4;
  /// After searches that cost so many times what it takes to write a front, it is written anew.
  static constexpr double kRenewal = 12;
  static constexpr std::size_t kSample = 32, kSparse = 16, kChecked = 512;
  static constexpr int kMostPromises = 1 << 20;

  bool isWhole() const { return every_ == 1; }
  /// A sample has kSample of many pairs; of fewer, one in kSparse, but not less than kSparse.
  static std::size_t samplingStride(std::size_t pairs) {
    return std::max({std::size_t(2), pairs / kSample, std::min(kSparse, pairs / kSparse)});
  }
  /// What it costs to search below a pair that no longer prunes.
  double searchBelow() const { return search_below_ * cost_from_roots_ / double(stops_ + 1); }
  double expectedCost(const PairSearch<BV>& search) const;
  void searchFromRoots(PairSearch<BV>& search, bool& are_near, std::size_t every);
  void searchFromPairs(PairSearch<BV>& search, bool are_near);

  RigidMotion<S> rigid_;
  std::uint64_t generations_[2] = {0, 0};
  std::vector<FrontPair> pairs_, added_;
  std::size_t every_ = kSparse;             // 1: a whole front; else one pair in so many
  std::size_t stops_ = kSparse * kSample;   // pairs where the last search from the roots stopped
  double cost_from_roots_ = 0;              // of that search,
  double cost_of_stops_ = 0;                // and of what it kept
  double search_below_ = 1;                 // see searchBelow; as measured, smoothed
  int promises_ = 0, needed_promises_ = 2;  // in a row
  /// Of the searches from the front since it was written: what they cost, the cheapest of them,
  /// what the others cost more, and what all saved, less the writing.
  struct Account {
    double spent = 0, cheapest = std::numeric_limits<double>::max(), excess = 0, saved = 0;
    void add(double cost, double cost_from_roots) {
      spent += cost;
      cheapest = std::min(cheapest, cost);
      excess += cost - cheapest;
      saved += cost_from_roots - cost;
    }
  } account_;
};

/// What is kept of a pair of models between two distance queries.
template <typename BV>
struct PairCache {
  /// The two triangles that were nearest last: their distance is a first upper bound.
  int witness1 = 0, witness2 = 0;
  bool are_near = false;  ///< see PairSearch::fromRoots
  std::optional<Front<BV>> front;
};

/// The exact distance by the boxes of both models, which both must have. False when the objects lie
/// too far apart for that, and nothing was done.
template <typename BV>
bool distanceByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                     const DistanceQuery<typename BV::S>& query, PairCache<BV>& cache);

/// Whether the distance is at most `enough`, by the boxes of both models as above. When it is not,
/// `farther` is a lower bound of it: what was passed, or the distance where it is less. Nothing
/// when the objects lie too far apart for that; or when it is to be `brief`, and many boxes were
/// tested.
template <typename BV>
std::optional<bool> compareByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                   typename BV::S enough, bool brief, PairCache<BV>& cache,
                                   typename BV::S& farther);

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class Front<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
