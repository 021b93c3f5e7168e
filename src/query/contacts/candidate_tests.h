#pragma once

#include <algorithm>

#include "base/shortcut.h"
#include "query/pair_corners.h"
#include "query/pair_filter.h"
#include "query/tree_pair.h"
#include "query/triangle_search.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {

/// The tests of a contact query: receives pairs of triangles whose boxes overlap (TriangleSearch),
/// leaves out neighbours, and collects the other pairs in batches. In a batch, the pairs that are
/// certainly apart are removed first, four or eight at a time: by their planes and edges, then by
/// all axes that can separate two triangles. If both trees have the same coordinates, all of this
/// uses the trees' positions and residuals (pair_tests.h); else the last step uses the meshes' own
/// positions. The exact test decides about the few pairs that remain uncertain.
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
      : input_(input),
        frame_(frame),
        sink_(sink),
        errors_(pairErrors(frame, input.tree1.scale(), 0)) {}

  /// Collects pairs of two leaves' triangles: bit 4 j + i for triangle i of `a` and j of `b`.
  ADAPTIVE_BVH_INLINE void foundLeaves(const WideNode& a, const WideNode& b, unsigned pairs) {
    if (size_ > batch_ - 16) testAll();
    pairs = withoutNeighbours(pairs, input_.tree1, a, input_.tree2, b, input_.left_out);
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs);
      pairs_[size_++] = {static_cast<unsigned>(a.first + (bit & 3)),
                         static_cast<unsigned>(b.first + (bit >> 2))};
    }
  }
  bool isDone() const { return is_done_; }
  /// Starts another run of the search, even if there were enough contacts before.
  void begin() {
    is_done_ = sink_.isDone();
    batch_ = sink_.needsFew() ? kFirstBatch : kSize;
  }
  /// Tests the pairs that were found but not yet tested.
  void finish() { testAll(); }

 private:
  // The first batches are small if few contacts are needed.
  static constexpr int kFirstBatch = 32, kSize = 256;

  /// Tests the batch and empties it. The next one is larger.
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

  /// For trees with the same coordinates: residuals make positions as precise as the mesh's own.
  void testWithResiduals() {
    constexpr int kAtOnce = 32;  // small, as there may soon be enough contacts
    const PairSource source = sourceOf(input_);
    size_ = keepByNormals(source, pairs_, size_, errors_);
    PairVerdict verdicts[kAtOnce];
    for (int i = 0; i < size_ && !is_done_; i += kAtOnce) {
      const int count = std::min(kAtOnce, size_ - i);
      pairTests().judge(source, pairs_ + i, count, errors_.fine, verdicts);
      for (int k = 0; k < count && !is_done_; ++k)
        settle(pairs_[i + k], verdicts[k] == PairVerdict::Apart,
               verdicts[k] == PairVerdict::Touching);
    }
  }

  /// For other trees: first in the coordinates of the first tree, then in those of the meshes.
  void testInBothCoordinates() {
    padToFour(pairs_, size_);
    size_ = keep([&](const auto& group) { return inTree(group).apartByPlanes(errors_.coarse); });
    padToFour(pairs_, size_);
    size_ =
        keep([&](const auto& group) { return inTree(group).apartByEdgeNormals(errors_.coarse); });
    padToFour(pairs_, size_);
    for (int i = 0; i < size_ && !is_done_; i += 4) {
      const LeafIndexPair group[4] = {pairs_[i], pairs_[i + 1], pairs_[i + 2], pairs_[i + 3]};
      const PairVerdicts verdicts = inMesh(group).verdicts(errors_.fine);
      for (int k = 0; k < 4 && i + k < size_ && !is_done_; ++k)
        settle(pairs_[i + k], verdicts.apart >> k & 1, verdicts.touching >> k & 1);
    }
  }

  /// Passes a pair to the sink unless it is `apart`: if `touching` to `add`, else to `test`.
  void settle(const LeafIndexPair& pair, bool apart, bool touching) {
    if (apart) return;
    if (input_.left_out.filter == NeighbourFilter::BeyondShared && !meetBeyondShared(pair)) return;
    const int i = input_.tree1.triangle(pair.first), j = input_.tree2.triangle(pair.second);
    if (touching)
      sink_.add(i, j);
    else
      sink_.test(i, j);
    is_done_ = sink_.isDone();
  }

  bool meetBeyondShared(const LeafIndexPair& pair) const {
    return adaptive_bvh::meetBeyondShared(
        input_.first.pointsAt(pair.first), input_.tree1.slots().verticesOf(pair.first),
        input_.second.pointsAt(pair.second), input_.tree2.slots().verticesOf(pair.second));
  }

  /// Keeps pairs that are not apart; returns their number. areApart(group): a bit for each of four.
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
  ADAPTIVE_BVH_INLINE TrianglePairs4 inTree(const LeafIndexPair (&group)[4]) const {
    Vector4x3 p[3], q[3];
    gatherCorners(input_, frame_, group, p, q);
    return TrianglePairs4(p, q);
  }

  /// Four pairs from the meshes' own positions, in the first mesh's frame.
  TrianglePairs4 inMesh(const LeafIndexPair (&group)[4]) const {
    TriangleDifferences differences(input_.tree1.scale());
    for (int k = 0; k < 4; ++k)
      differences.set(k, input_.pointsOfFirst(group[k].first),
                      input_.pointsOfSecond(group[k].second));
    return differences.pairs();
  }

  const PairInput input_;
  const Frame& frame_;
  Sink& sink_;
  const PairErrors errors_;
  LeafIndexPair pairs_[kSize + 3];  ///< the batch; the last three are padding
  int size_ = 0;
  int batch_ = kSize;  ///< number of pairs at which the batch is tested
  bool is_done_ = false;
};

/// A walk over two trees with these tests.
template <typename Frame, typename Sink>
using CandidateSearch = TriangleSearch<CandidateTests<Frame, Sink>>;

/// Passes every pair to the exact test; for poses that single precision cannot express.
template <typename Sink>
void testAllCandidates(const PairInput& input, Sink& sink) {
  if (areBallsFarther(input.first, input.second, input.to_first, 0)) return;
  for (int i = 0; i < input.first.mesh.numTriangles(); ++i)
    for (int j = 0; j < input.second.mesh.numTriangles() && !sink.isDone(); ++j) sink.test(i, j);
}

}  // namespace adaptive_bvh
