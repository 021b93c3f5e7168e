#pragma once

#include <atomic>

#include "base/shortcut.h"
#include "ccd/continuous_search.h"
#include "ccd/pair_batches.h"

namespace adaptive_bvh {

/// The order of impacts: by time, then by kind and numbers.
inline bool isEarlier(const Impact& a, const Impact& b) {
  if (a.time != b.time) return a.time < b.time;
  if (a.kind != b.kind) return a.kind < b.kind;
  return a.pair < b.pair;
}

/// A visitor of FeatureFinder, and a sink of searchAll, that finds the earliest impact; with kLists
/// it also lists all pairs. It discards pairs that stay apart until the earliest impact so far:
/// four at a time, in single precision. For the others it computes the time of impact.
template <bool kLists>
class EarliestImpact : public PairBatches<EarliestImpact<kLists>> {
 public:
  /// `separation`: in the unit of the world. `best`: earliest time so far, of all threads. `pairs`
  /// is not read without kLists.
  EarliestImpact(const SweptPair& pair, const SweptFrame& frame, const TimeInterval& interval,
                 double separation, std::atomic<double>& best, FeaturePairs& pairs)
      : PairBatches<EarliestImpact>(pair),
        interval_(interval),
        separation_(separation),
        scaled_separation_(frame.lengthUp(separation)),
        best_(best),
        pairs_(&pairs) {
    impact_.time = MovingFeatures::kNever;
  }

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    if (kLists) lists().vertexFace(v, t);
    PairBatches<EarliestImpact>::vertexFace(v, t);
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    if (kLists) lists().faceVertex(t, v);
    PairBatches<EarliestImpact>::faceVertex(t, v);
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    if (kLists) lists().edgeEdge(e, f);
    PairBatches<EarliestImpact>::edgeEdge(e, f);
  }
  void clear() {
    if (kLists) pairs_->clear();
  }
  const Impact& impact() const { return impact_; }
  FeatureLists lists() const { return {pair_, *pairs_}; }

  // The interface of a sink of searchAll.
  using Result = FeaturePairs;
  EarliestImpact another(Result& result) const {
    EarliestImpact other = *this;
    other.pairs_ = &result;
    return other;
  }
  using Mark = FeatureMark;
  Mark mark() const { return kLists ? lists().mark() : Mark(); }
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    for (const Found& task : tasks)
      impact_ = std::min(impact_, task.worker->sink().impact_, isEarlier);
    if (kLists) lists().take(tasks, pool);
  }

 private:
  friend PairBatches<EarliestImpact>;
  using typename PairBatches<EarliestImpact>::PairRef;
  using PairBatches<EarliestImpact>::kSwapped;
  using PairBatches<EarliestImpact>::pair_;

  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE unsigned decided(const MovingPairs4& four) const {
    return isTaken(Shortcut::SinglePrecision) ? stayApart<kNumFirst>(four, limits()) : 0;
  }

  /// Limits of the test of four pairs: its end is the earliest impact, as a share of the interval.
  MovingPairs4Limits limits() const {
    const double until = std::min(best_.load(std::memory_order_relaxed), interval_.end);
    const double share = (until - interval_.begin) / (interval_.end - interval_.begin);
    return {scaled_separation_, std::max(pair_.tree1.positionError(), pair_.tree2.positionError()),
            std::min(1.f, static_cast<float>(std::max(share, 0.)) * (1 + 1.f / (1 << 20)))};
  }

  /// Computes the time of impact of a pair, and keeps the impact if it is the earliest.
  template <int kNumFirst>
  void test(const PairRef& ref, unsigned) {
    Impact impact = numbersOf<kNumFirst>(ref);
    const double best = best_.load(std::memory_order_relaxed);
    impact.time = movingFeatures(pair_.first, pair_.second, impact.kind, impact.pair)
                      .timeOfImpact(separation_, std::min(best, interval_.end));
    if (!(impact.time <= best) || !isEarlier(impact, impact_)) return;
    impact_ = impact;
    for (double now = best; impact.time < now && !best_.compare_exchange_weak(now, impact.time);) {
    }
  }

  /// The kind and the feature numbers of a pair; the time is 0.
  template <int kNumFirst>
  Impact numbersOf(const PairRef& ref) const {
    const MovingMesh &a = pair_.first, &b = pair_.second;
    if (kNumFirst == 2) {
      FeaturePair edges = {a.features->edges()[ref.first].number,
                           b.features->edges()[ref.second].number};
      if (pair_.isSelf() && edges.second < edges.first) std::swap(edges.first, edges.second);
      return {0, FeatureKind::EdgeEdge, edges};
    }
    const bool swapped = ref.second & kSwapped;
    const unsigned vertex = (swapped ? b : a).features->vertices()[ref.first].vertex;
    const unsigned face = (*(swapped ? a : b).owners)[ref.second & ~kSwapped].triangle;
    if (swapped && !pair_.isSelf()) return {0, FeatureKind::FaceVertex, {face, vertex}};
    return {0, FeatureKind::VertexFace, {vertex, face}};
  }

  const TimeInterval interval_;
  const double separation_;
  const float scaled_separation_;
  std::atomic<double>& best_;
  FeaturePairs* pairs_;
  Impact impact_;
};

}  // namespace adaptive_bvh
