#pragma once

#include "ccd/feature_search.h"
#include "triangles/moving_pairs4.h"

namespace adaptive_bvh {

/// A visitor of FeatureFinder that collects pairs in batches. It passes them to the class derived
/// from it, four at a time in single precision, then the others one by one.
///
///   tests.decided<kNumFirst>(four)  a bit for each of four MovingPairs4 that needs no further test
///   tests.test<kNumFirst>(ref, k)   called for each of the others, the k-th of these four
///
/// kNumFirst: number of corners of a pair's first feature, 1 for a vertex and 2 for an edge.
template <typename Tests>
class PairBatches {
 public:
  // Called by FeatureFinder, which explains the arguments.
  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    add<1>(points_, num_points_, {v, t});
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    add<1>(points_, num_points_, {v, t | kSwapped});
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) { add<2>(edges_, num_edges_, {e, f}); }
  void finish() {
    testAll<1>(points_, num_points_);
    testAll<2>(edges_, num_edges_);
  }

 protected:
  explicit PairBatches(const SweptPair& pair) : pair_(pair) {}

  /// A pair in a batch: two owned edges; or an owned vertex and the leaf index of a triangle, with
  /// kSwapped if the triangle is in the first mesh. (Owned features: see FeatureFinder.)
  using PairRef = FeaturePair;
  static constexpr unsigned kSwapped = 1u << 31;

  /// The vertices of a pair's four corners. The first kNumFirst are of the first mesh, the others
  /// of the second; or vice versa if `swapped`.
  struct CornerVertices {
    bool swapped;
    unsigned vertices[4];
  };
  template <int kNumFirst>
  CornerVertices verticesOf(const PairRef& ref) const {
    const MovingMesh &a = pair_.first, &b = pair_.second;
    if (kNumFirst == 2) {
      const unsigned *e = a.features->edges()[ref.first].vertices,
                     *f = b.features->edges()[ref.second].vertices;
      return {false, {e[0], e[1], f[0], f[1]}};
    }
    const bool swapped = ref.second & kSwapped;
    const Int4& face = (swapped ? a : b).vertices[ref.second & ~kSwapped];
    return {swapped,
            {(swapped ? b : a).features->vertices()[ref.first].vertex, unsigned(face[0]),
             unsigned(face[1]), unsigned(face[2])}};
  }

  const SweptPair& pair_;

 private:
  static constexpr unsigned kBatch = 256;

  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE void add(PairRef (&refs)[kBatch], unsigned& count, const PairRef& ref) {
    refs[count++] = ref;
    if (count == kBatch) testAll<kNumFirst>(refs, count);
  }

  /// Tests the pairs of a batch, and empties it.
  template <int kNumFirst>
  void testAll(PairRef (&refs)[kBatch], unsigned& count) {
    Tests& tests = static_cast<Tests&>(*this);
    for (unsigned i = count; i % 4; ++i) refs[i] = refs[count - 1];
    for (unsigned i = 0; i < count; i += 4) {
      const unsigned decided = tests.template decided<kNumFirst>(gather<kNumFirst>(&refs[i]));
      for (unsigned k = 0; k < 4 && i + k < count; ++k)
        if (!(decided >> k & 1)) tests.template test<kNumFirst>(refs[i + k], k);
    }
    count = 0;
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

  PairRef points_[kBatch], edges_[kBatch];  ///< pairs of a vertex and a face, and of edges
  unsigned num_points_ = 0, num_edges_ = 0;
};

}  // namespace adaptive_bvh
