#pragma once

#include <atomic>

#include "base/shortcut.h"
#include "ccd/continuous_search.h"
#include "ccd/feature_search.h"
#include "triangles/moving_pairs4.h"

namespace adaptive_bvh {

/// The order of impacts: by time, then by kind and numbers.
inline bool isEarlier(const Impact& a, const Impact& b) {
  if (a.time != b.time) return a.time < b.time;
  if (a.kind != b.kind) return a.kind < b.kind;
  return a.pair < b.pair;
}

/// A visitor of FeatureFinder, and a sink of searchAll, that finds the earliest impact. It collects
/// pairs in batches, and discards pairs that stay apart until the earliest impact so far: four at a
/// time, in single precision. For the others it computes the time of impact.
template <bool kIsSelf>
class EarliestImpact {
 public:
  /// `separation`: in the unit of the world. `best`: earliest time so far, of all threads.
  EarliestImpact(const SweptPair& pair, const SweptFrame& frame, const TimeInterval& interval,
                 double separation, std::atomic<double>& best)
      : pair_(pair),
        interval_(interval),
        separation_(separation),
        scaled_separation_(static_cast<float>(std::min(frame.scale * separation, 1e20)) *
                           (1 + 1.f / (1 << 20))),
        best_(best) {
    impact_.time = MovingFeatures::kNever;
  }

  // Called by FeatureFinder, which explains the arguments.
  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    add<1>(points_, num_points_, {v, t});
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    add<1>(points_, num_points_, {v, t | kSwapped});
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) { add<2>(edges_, num_edges_, {e, f}); }

  void clear() {}
  void finish() {
    testAll<1>(points_, num_points_);
    testAll<2>(edges_, num_edges_);
  }
  const Impact& impact() const { return impact_; }

  // The interface of a sink of searchAll. The only result is the impact.
  struct Result {};
  EarliestImpact another(Result&) const { return *this; }
  struct Mark {};
  Mark mark() const { return {}; }
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool&) {
    for (const Found& task : tasks) take(task.worker->sink());
  }
  /// Takes the impact of another thread if it is earlier.
  void take(const EarliestImpact& worker) {
    if (isEarlier(worker.impact_, impact_)) impact_ = worker.impact_;
  }

 private:
  static constexpr unsigned kBatch = 256;

  /// A pair in a batch: two owned edges; or an owned vertex and the leaf index of a triangle, with
  /// kSwapped if the triangle is in the first mesh. (Owned features: see FeatureFinder.)
  using PairRef = FeaturePair;
  static constexpr unsigned kSwapped = 1u << 31;

  // kNumFirst: number of corners of a pair's first feature, 1 for a vertex and 2 for an edge.

  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE void add(PairRef (&refs)[kBatch], unsigned& count, const PairRef& ref) {
    refs[count++] = ref;
    if (count == kBatch) testAll<kNumFirst>(refs, count);
  }

  /// Tests the pairs of a batch, and empties it.
  template <int kNumFirst>
  void testAll(PairRef (&refs)[kBatch], unsigned& count) {
    for (unsigned i = count; i % 4; ++i) refs[i] = refs[count - 1];
    for (unsigned i = 0; i < count; i += 4) {
      const unsigned apart = isTaken(Shortcut::SinglePrecision)
                                 ? stayApart<kNumFirst>(gather<kNumFirst>(&refs[i]), limits())
                                 : 0;
      for (unsigned k = 0; k < 4 && i + k < count; ++k)
        if (!(apart >> k & 1)) test<kNumFirst>(refs[i + k]);
    }
    count = 0;
  }

  /// Limits of the test of four pairs: its end is the earliest impact, as a share of the interval.
  MovingPairs4Limits limits() const {
    const double until = std::min(best_.load(std::memory_order_relaxed), interval_.end);
    const double share = (until - interval_.begin) / (interval_.end - interval_.begin);
    return {scaled_separation_, std::max(pair_.tree1.positionError(), pair_.tree2.positionError()),
            std::min(1.f, static_cast<float>(std::max(share, 0.)) * (1 + 1.f / (1 << 20)))};
  }

  /// The slots of a pair's four corners, and the trees of the first kNumFirst and of the others.
  struct CornerSlots {
    const SweptTree *first, *second;
    unsigned slots[4];
  };
  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE CornerSlots slotsOf(const PairRef& ref) const {
    const MovingMesh &a = pair_.first, &b = pair_.second;
    if (kNumFirst == 2) {
      const OwnedEdge &e = a.features->edges()[ref.first], &f = b.features->edges()[ref.second];
      return {&pair_.tree1, &pair_.tree2, {e.slots[0], e.slots[1], f.slots[0], f.slots[1]}};
    }
    const bool swapped = ref.second & kSwapped;
    const VertexIndices face = (swapped ? a : b).slots->slotsOf(ref.second & ~kSwapped);
    return {swapped ? &pair_.tree2 : &pair_.tree1,
            swapped ? &pair_.tree1 : &pair_.tree2,
            {(swapped ? b : a).features->vertices()[ref.first].slot, face[0], face[1], face[2]}};
  }

  /// Loads the corners of four pairs, at the begin and the end of the interval.
  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE MovingPairs4 gather(const PairRef* refs) const {
    const CornerSlots pairs[4] = {slotsOf<kNumFirst>(refs[0]), slotsOf<kNumFirst>(refs[1]),
                                  slotsOf<kNumFirst>(refs[2]), slotsOf<kNumFirst>(refs[3])};
    MovingPairs4 all;
    for (int c = 0; c < 4; ++c) {
      const auto begin = [&](int k) -> const Float4& {
        return (c < kNumFirst ? pairs[k].first : pairs[k].second)->begins()[pairs[k].slots[c]];
      };
      const auto end = [&](int k) -> const Float4& {
        return (c < kNumFirst ? pairs[k].first : pairs[k].second)->ends()[pairs[k].slots[c]];
      };
      all.begin[c] = float4::columns(begin(0), begin(1), begin(2), begin(3));
      all.end[c] = float4::columns(end(0), end(1), end(2), end(3));
    }
    return all;
  }

  /// Computes the time of impact of a pair, and keeps the impact if it is the earliest.
  template <int kNumFirst>
  void test(const PairRef& ref) {
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
      if (kIsSelf && edges.second < edges.first) std::swap(edges.first, edges.second);
      return {0, FeatureKind::EdgeEdge, edges};
    }
    const bool swapped = ref.second & kSwapped;
    const unsigned vertex = (swapped ? b : a).features->vertices()[ref.first].vertex;
    const unsigned face = (*(swapped ? a : b).owners)[ref.second & ~kSwapped].triangle;
    if (swapped && !kIsSelf) return {0, FeatureKind::FaceVertex, {face, vertex}};
    return {0, FeatureKind::VertexFace, {vertex, face}};
  }

  const SweptPair& pair_;
  const TimeInterval interval_;
  const double separation_;
  const float scaled_separation_;
  std::atomic<double>& best_;
  Impact impact_;
  PairRef points_[kBatch], edges_[kBatch];  ///< pairs of a vertex and a face, and of edges
  unsigned num_points_ = 0, num_edges_ = 0;
};

/// A visitor of FeatureFinder that lists all pairs and finds the earliest impact.
template <bool kIsSelf>
class ListsAndImpact {
 public:
  ListsAndImpact(const FeatureLists<kIsSelf>& lists, const EarliestImpact<kIsSelf>& earliest)
      : lists_(lists), earliest_(earliest) {}

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    lists_.vertexFace(v, t);
    earliest_.vertexFace(v, t);
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    lists_.faceVertex(t, v);
    earliest_.faceVertex(t, v);
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    lists_.edgeEdge(e, f);
    earliest_.edgeEdge(e, f);
  }
  void clear() { lists_.clear(); }
  void finish() { earliest_.finish(); }
  const Impact& impact() const { return earliest_.impact(); }

  using Result = typename FeatureLists<kIsSelf>::Result;
  ListsAndImpact another(Result& result) const { return {lists_.another(result), earliest_}; }
  using Mark = typename FeatureLists<kIsSelf>::Mark;
  Mark mark() const { return lists_.mark(); }
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    for (const Found& task : tasks) earliest_.take(task.worker->sink().earliest_);
    lists_.take(
        tasks, pool, [](const Found& task) -> auto& { return task.worker->sink().lists_; });
  }

 private:
  FeatureLists<kIsSelf> lists_;
  EarliestImpact<kIsSelf> earliest_;
};

}  // namespace adaptive_bvh
