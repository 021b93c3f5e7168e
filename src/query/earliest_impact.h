#pragma once

#include <atomic>

#include "geometry/moving_pairs4.h"
#include "query/continuous_search.h"
#include "query/feature_tasks.h"

namespace adaptive_bvh {

/// The earlier of two; of equally early ones that with the smaller numbers.
inline bool isEarlier(const Impact& a, const Impact& b) {
  if (a.time != b.time) return a.time < b.time;
  if (a.kind != b.kind) return a.kind < b.kind;
  return a.pair < b.pair;
}

/// A visitor of FeatureFinder that looks for the earliest impact. Pairs are collected, and by the
/// hundred those are left out that surely stay apart up to the earliest impact so far, four at a
/// time in single precision; of the others the time of impact decides.
template <bool kIsSelf>
class EarliestImpact {
 public:
  /// `separation`: in the unit of the world. `best`: shared by the threads of a query.
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

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned i, unsigned k, unsigned j) {
    add<1>(points_, num_points_, {3 * i + k, 3 * j});
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned i, unsigned j, unsigned l) {
    add<1>(points_, num_points_, {3 * j + l, 3 * i + 1});
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned i, unsigned k, unsigned j, unsigned l) {
    add<2>(edges_, num_edges_, {3 * i + k, 3 * j + l});
  }

  void finish() {
    testAll<1>(points_, num_points_);
    testAll<2>(edges_, num_edges_);
  }
  const Impact& impact() const { return impact_; }
  long pairs() const { return pairs_; }           ///< whose boxes overlap
  long timeTests() const { return time_tests_; }  ///< of which the time of impact decided

  EarliestImpact forWorker() const { return EarliestImpact(*this); }
  struct Mark {};
  Mark mark() const { return {}; }
  void take(const EarliestImpact& worker, Mark, Mark) {
    if (isEarlier(worker.impact_, impact_)) impact_ = worker.impact_;
  }

 private:
  static constexpr unsigned kSize = 256;

  /// Corners of triangles by place, 3 place + corner: a vertex and a face, whose number is one more
  /// where the face is of the first mesh; or the first ends of two edges.
  using Ref = FeaturePair;

  template <int kFirsts>
  ADAPTIVE_BVH_INLINE void add(Ref (&refs)[kSize], unsigned& count, const Ref& ref) {
    refs[count++] = ref;
    if (count == kSize) testAll<kFirsts>(refs, count);
  }

  template <int kFirsts>
  void testAll(Ref (&refs)[kSize], unsigned& count) {
    pairs_ += count;
    for (unsigned i = count; i % 4; ++i) refs[i] = refs[count - 1];
    for (unsigned i = 0; i < count; i += 4) {
      unsigned apart = stayApart<kFirsts>(gather<kFirsts>(&refs[i]), limits());
      for (unsigned k = 0; k < 4 && i + k < count; ++k)
        if (!(apart >> k & 1)) test<kFirsts>(refs[i + k]);
    }
    count = 0;
  }

  MovingPairs4Limits limits() const {
    const double until = std::min(best_.load(std::memory_order_relaxed), interval_.end);
    const double share = (until - interval_.begin) / (interval_.end - interval_.begin);
    return {scaled_separation_, std::max(pair_.tree1.positionError(), pair_.tree2.positionError()),
            std::min(1.f, static_cast<float>(std::max(share, 0.)) * (1 + 1.f / (1 << 20)))};
  }

  template <int kFirsts>
  ADAPTIVE_BVH_INLINE MovingPairs4 gather(const Ref* refs) const {
    const Float4* begin[4][4];
    const Float4* end[4][4];
    for (int pair = 0; pair < 4; ++pair)
      for (int c = 0; c < 4; ++c) {
        const bool is_first = c < kFirsts;
        const unsigned ref = is_first ? refs[pair].first : refs[pair].second;
        // A vertex may be the second mesh's: then the face is the first's.
        const bool swapped = kFirsts == 1 && refs[pair].second % 3 == 1;
        const bool of_first = is_first != swapped;
        const MovingMesh& mesh = of_first ? pair_.first : pair_.second;
        const SweptTree& tree = of_first ? pair_.tree1 : pair_.tree2;
        const unsigned corner = kFirsts == 2 ? (ref % 3 + unsigned(c % 2)) % 3
                                : is_first   ? ref % 3
                                             : unsigned(c - 1);
        const unsigned slot = mesh.slots->slotsOf(ref / 3)[corner];
        begin[c][pair] = &tree.begins()[slot];
        end[c][pair] = &tree.ends()[slot];
      }
    MovingPairs4 all;
    for (int c = 0; c < 4; ++c) {
      all.begin[c] = float4::columns(*begin[c][0], *begin[c][1], *begin[c][2], *begin[c][3]);
      all.end[c] = float4::columns(*end[c][0], *end[c][1], *end[c][2], *end[c][3]);
    }
    return all;
  }

  template <int kFirsts>
  void test(const Ref& ref) {
    ++time_tests_;
    Impact impact = numbersOf<kFirsts>(ref);
    const double best = best_.load(std::memory_order_relaxed);
    impact.time = movingFeatures(pair_.first, pair_.second, impact.kind, impact.pair)
                      .timeOfImpact(separation_, std::min(best, interval_.end));
    if (!(impact.time <= best) || !isEarlier(impact, impact_)) return;
    impact_ = impact;
    for (double now = best; impact.time < now && !best_.compare_exchange_weak(now, impact.time);) {
    }
  }

  template <int kFirsts>
  Impact numbersOf(const Ref& ref) const {
    const auto triangle = [](const MovingMesh& mesh, unsigned corner) {
      return (*mesh.owners)[corner / 3].triangle;
    };
    const auto vertex = [](const MovingMesh& mesh, unsigned corner) {
      return static_cast<unsigned>(mesh.vertices[corner / 3][int(corner % 3)]);
    };
    const MovingMesh &a = pair_.first, &b = pair_.second;
    if (kFirsts == 2) {
      FeaturePair edges = {3 * triangle(a, ref.first) + ref.first % 3,
                           3 * triangle(b, ref.second) + ref.second % 3};
      if (kIsSelf && edges.second < edges.first) std::swap(edges.first, edges.second);
      return {0, FeatureKind::EdgeEdge, edges};
    }
    if (ref.second % 3 == 0)
      return {0, FeatureKind::VertexFace, {vertex(a, ref.first), triangle(b, ref.second)}};
    const FeaturePair swapped = {triangle(a, ref.second), vertex(b, ref.first)};
    if (kIsSelf) return {0, FeatureKind::VertexFace, {swapped.second, swapped.first}};
    return {0, FeatureKind::FaceVertex, swapped};
  }

  const SweptPair& pair_;
  const TimeInterval interval_;
  const double separation_;
  const float scaled_separation_;
  std::atomic<double>& best_;
  Impact impact_;
  Ref points_[kSize], edges_[kSize];
  unsigned num_points_ = 0, num_edges_ = 0;
  long pairs_ = 0, time_tests_ = 0;
};

}  // namespace adaptive_bvh
