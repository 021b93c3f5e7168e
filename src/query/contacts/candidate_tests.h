#pragma once

#include <algorithm>

#include "adaptive_bvh/self_collision.h"
#include "base/shortcut.h"
#include "query/pair_corners.h"
#include "query/pair_filter.h"
#include "query/tree_pair.h"
#include "query/triangle_search.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {

/// Tests pairs of triangles whose boxes overlap. Leaves out neighbours and collects the other pairs
/// in batches. In a batch, the pairs that are certainly apart are removed first, four or eight at a
/// time: by their planes and edges, then by all axes that can separate two triangles. If both trees
/// have the same coordinates, all of this uses positions and residuals (pair_tests.h); else the
/// last step uses the model's own positions. The exact test decides about the few pairs that remain
/// uncertain.
///
///   frame(points)            points of the second tree in the coordinates of the first
///   sink.test(i, j)          the exact test of two triangles, by their indices; adds their
///                            contacts
///   sink.add(i, j)           adds the contacts of two triangles that touch
///   sink.isDone()            whether there are enough contacts
///   sink.needsFew()          whether a few contacts are enough
template <typename Frame, typename Sink>
class CandidateTests {
 public:
  CandidateTests(Sink& sink, const PairInput& input, const Frame& frame)
      : in_(input),
        frame_(frame),
        sink_(sink),
        errors_(pairErrors(frame, input.tree1.scale(), 0)) {}

  ADAPTIVE_BVH_INLINE void foundLeaves(const WideNode& a, const WideNode& b, unsigned pairs) {
    if (size_ > batch_ - 16) testAll();
    pairs = withoutNeighbours(pairs, in_.tree1, a, in_.tree2, b, in_.filter);
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs);
      pairs_[size_++] = {static_cast<unsigned>(a.first + (bit & 3)),
                         static_cast<unsigned>(b.first + (bit >> 2))};
    }
  }
  bool isDone() const { return is_done_; }
  /// Starts another run, even if there were enough contacts before.
  void begin() {
    is_done_ = sink_.isDone();
    batch_ = sink_.needsFew() ? kFirstBatch : kSize;
  }
  /// Tests the pairs that were found but not yet tested.
  void finish() { testAll(); }

 private:
  // The first batches are small if few contacts are needed.
  static constexpr int kFirstBatch = 32, kSize = 256;

  void testAll() {
    if (!isTaken(Shortcut::SinglePrecision))
      for (int i = 0; i < size_ && !is_done_; ++i) settle(pairs_[i], false, false);
    else if constexpr (Frame::kIsIdentity)
      testWithResiduals();
    else
      testInBothCoordinates();
    size_ = 0;
    batch_ = std::min(2 * batch_, kSize);
  }

  /// For trees with the same coordinates: their positions with residuals are as precise as the
  /// model's own positions.
  void testWithResiduals() {
    constexpr int kAtOnce = 32;  // small, as there may soon be enough contacts
    const PairSource from = sourceOf(in_);
    size_ = keepByNormals(from, pairs_, size_, errors_);
    PairVerdict verdicts[kAtOnce];
    for (int i = 0; i < size_ && !is_done_; i += kAtOnce) {
      const int count = std::min(kAtOnce, size_ - i);
      pairTests().judge(from, pairs_ + i, count, errors_.fine, verdicts);
      for (int k = 0; k < count && !is_done_; ++k)
        settle(pairs_[i + k], verdicts[k] == PairVerdict::Apart,
               verdicts[k] == PairVerdict::Touching);
    }
  }

  void testInBothCoordinates() {
    padToFour(pairs_, size_);
    size_ = keep([&](const auto& group) { return coarse(group).apartByPlanes(errors_.coarse); });
    padToFour(pairs_, size_);
    size_ =
        keep([&](const auto& group) { return coarse(group).apartByEdgeNormals(errors_.coarse); });
    padToFour(pairs_, size_);
    for (int i = 0; i < size_ && !is_done_; i += 4) {
      const LeafIndexPair group[4] = {pairs_[i], pairs_[i + 1], pairs_[i + 2], pairs_[i + 3]};
      const PairVerdicts verdicts = inModel(group).verdicts(errors_.fine);
      for (int k = 0; k < 4 && i + k < size_ && !is_done_; ++k)
        settle(pairs_[i + k], verdicts.apart >> k & 1, verdicts.touching >> k & 1);
    }
  }

  void settle(const LeafIndexPair& pair, bool apart, bool touching) {
    if (apart) return;
    if (in_.filter == NeighbourFilter::BeyondShared && !meetBeyondShared(pair)) return;
    const int i = in_.tree1.triangle(pair.first), j = in_.tree2.triangle(pair.second);
    if (touching)
      sink_.add(i, j);
    else
      sink_.test(i, j);
    is_done_ = sink_.isDone();
  }

  bool meetBeyondShared(const LeafIndexPair& pair) const {
    return adaptive_bvh::meetBeyondShared(
        in_.first.pointsAt(pair.first), in_.tree1.slots().verticesOf(pair.first),
        in_.second.pointsAt(pair.second), in_.tree2.slots().verticesOf(pair.second));
  }

  /// Keeps, in order, the pairs that `areApart` does not report. Returns their number.
  template <typename AreApart>
  ADAPTIVE_BVH_INLINE int keep(const AreApart& areApart) {
    int kept = 0;
    for (int i = 0; i < size_; i += 4) {
      const LeafIndexPair group[4] = {pairs_[i], pairs_[i + 1], pairs_[i + 2], pairs_[i + 3]};
      const unsigned apart = areApart(group);
      for (int k = 0; k < 4; ++k) {
        pairs_[kept] = group[k];
        kept += !(apart >> k & 1) & (i + k < size_);
      }
    }
    return kept;
  }

  /// Four pairs in the coordinates of the first tree.
  ADAPTIVE_BVH_INLINE TrianglePairs4 coarse(const LeafIndexPair (&group)[4]) const {
    Vector4x3 p[3], q[3];
    gatherCorners(in_, frame_, group, p, q);
    return TrianglePairs4(p, q);
  }

  /// Four pairs from the meshes' own positions.
  TrianglePairs4 inModel(const LeafIndexPair (&group)[4]) const {
    TriangleDifferences differences(in_.tree1.scale());
    for (int k = 0; k < 4; ++k) {
      differences.set(k, in_.pointsOfFirst(group[k].first), in_.pointsOfSecond(group[k].second));
    }
    return differences.pairs();
  }

  const PairInput in_;
  const Frame& frame_;
  Sink& sink_;
  const PairErrors errors_;
  LeafIndexPair pairs_[kSize + 3];
  int size_ = 0;
  int batch_ = kSize;  ///< number of pairs that are tested together
  bool is_done_ = false;
};

/// A search whose sink takes the contacts.
template <typename Frame, typename Sink>
using CandidateSearch = TriangleSearch<CandidateTests<Frame, Sink>>;

/// Tests every pair; for placements that single precision cannot express.
template <typename Sink>
void testAllCandidates(const PairInput& input, Sink& sink) {
  if (areBallsFarther(input.first, input.second, input.to_first, 0)) return;
  for (int i = 0; i < input.first.mesh.numTriangles(); ++i)
    for (int j = 0; j < input.second.mesh.numTriangles() && !sink.isDone(); ++j) sink.test(i, j);
}

}  // namespace adaptive_bvh
