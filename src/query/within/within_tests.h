#pragma once

#include <cstdint>

#include "base/rigid.h"
#include "base/shortcut.h"
#include "query/pair_corners.h"
#include "query/pair_filter.h"
#include "query/tree_pair.h"
#include "query/triangle_search.h"
#include "triangles/exact_nearness.h"
#include "triangles/triangle_block.h"
#include "triangles/triangle_distances4.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// Finds the pairs of triangles within a distance ("near"), among those whose boxes, grown by the
/// distance, overlap. The Tests of a TriangleSearch. In single precision, several pairs at a time,
/// it finds pairs that are certainly near or apart: by corners, for one triangle and those of a
/// leaf, or along separating axes (kByAxes); then, in batches, by edges and faces. The distance in
/// double precision decides about the few pairs left, and exact arithmetic about those that are
/// within its error of the limit.
///
///   sink.add(pair, gap)   takes a near pair, in the order in which pairs are found; `gap` may be
///                         null unless needsGap()
///   sink.needsGap()       whether it needs distances or nearest points
///   sink.isDone()         whether there are enough pairs
///   Sink::kStopsAtFirst   whether one pair is enough; then most tested pairs are apart
///   Sink::kTakesUndecided whether it takes all pairs that the corners do not prove to be apart:
///                         no further tests are made
///   Sink::kTakesOpen      whether it takes pairs that single precision leaves open
///   Sink::kBatch          number of pairs that are tested together, at least 32
template <typename Frame, typename Sink>
class WithinTests {
 public:
  WithinTests(Sink& sink, const PairInput& input, const Frame& frame)
      : in_(input),
        frame_(frame),
        sink_(sink),
        limit_(
            static_cast<float>(std::min(input.distance * input.tree1.scale(), double(kLargest)))),
        errors_(pairErrors(frame, input.tree1.scale(), limit_ * kUp)),
        nearness_(input.distance,
                  input.first.bounds().aabb_radius + input.second.bounds().aabb_radius) {}

  /// Tests triangles of two leaves: bit 4 j + i of `pairs` for triangle i of a and j of b.
  ADAPTIVE_BVH_INLINE void foundLeaves(const WideNode& a, const WideNode& b, unsigned pairs) {
    pairs = withoutNeighbours(pairs, in_.tree1, a, in_.tree2, b, in_.left_out);
    if (!pairs) return;
    if (size_ > batch_ - 16) testAll();  // room for the pairs of two leaves
    if (!isTaken(Shortcut::SinglePrecision)) return addPairs(a, b, pairs);
    if constexpr (kByAxes) return addPairs(a, b, nearSlab(a, b, pairs));
    readFirst(a);
    readSecond(b);
    for (int j = 0; pairs; ++j, pairs >>= 4)
      if (const unsigned row = pairs & 15) testRow(a, b, j, row);
  }
  bool isDone() const { return sink_.isDone(); }
  void begin() {}
  /// Tests the pairs that were found but not yet tested.
  void finish() { testAll(); }

  /// Passes a pair to the sink if it is near, without tests in single precision.
  void testAlone(const LeafIndexPair& pair) { settle(pair, kOpen); }

 private:
  static constexpr int kFirstBatch = 32;  // small, if one pair is enough
  static constexpr float kLargest = 1e30f;
  static constexpr float kUp = 1 + 1.f / (1 << 20);  // for the rounding of the limit
  enum Verdict : std::uint8_t { kOpen, kNear, kApart };

  /// Gathers the corners of a leaf, in the first tree's coordinates, if it is not the last one.
  ADAPTIVE_BVH_INLINE void readFirst(const WideNode& leaf) {
    if (&leaf == first_leaf_) return;
    first_leaf_ = &leaf;
    Vector4x3 corners[3];
    gatherLeaf(in_.tree1.slots(), in_.tree1.positions(), leaf, corners);
    first_ = TriangleDistances4::Seen(corners);
  }
  ADAPTIVE_BVH_INLINE void readSecond(const WideNode& leaf) {
    if (&leaf == second_leaf_) return;
    second_leaf_ = &leaf;
    gatherLeaf(in_.tree2.slots(), in_.tree2.positions(), leaf, second_);
    for (Vector4x3& corner : second_) corner = frame_(corner);
  }

  /// Tests the triangles `row` of leaf a, a bit for each, with triangle j of leaf b, by their
  /// corners. Adds the pairs that are not certainly apart to the batch.
  ADAPTIVE_BVH_INLINE void testRow(const WideNode& a, const WideNode& b, int j, unsigned row) {
    using float4::all;
    Vector4x3 q[3];
    for (int k = 0; k < 3; ++k)
      q[k] = {all(second_[k].x[j]), all(second_[k].y[j]), all(second_[k].z[j])};
    const Nearness4 nearness = TriangleDistances4(first_, q, frame_.error()).byCorners(limit_, row);
    const auto second = static_cast<unsigned>(b.first + j);
    for (unsigned left = row & ~nearness.apart; left; left &= left - 1) {
      const int i = __builtin_ctz(left);
      pairs_[size_] = {static_cast<unsigned>(a.first + i), second};
      verdicts_[size_++] = static_cast<std::uint8_t>((nearness.near >> i & 1) * kNear);
    }
  }

  /// Whether pairs are first tested along separating axes (pair_tests.h), eight at a time: if most
  /// pairs are apart, and positions with residuals need no transformation.
  static constexpr bool kByAxes = Frame::kIsIdentity && Sink::kStopsAtFirst;

  /// Returns the pairs whose first triangle may be near a slab around the second leaf. Returns a
  /// single pair untested, because the slab takes as long as testing two pairs.
  ADAPTIVE_BVH_INLINE unsigned nearSlab(const WideNode& a, const WideNode& b, unsigned pairs) {
    if (!(pairs & (pairs - 1))) return pairs;
    if (&b != second_leaf_) {
      second_leaf_ = &b;
      gatherLeaf(in_.tree2.slots(), in_.tree2.positions(), b, second_);
      slab_ = LeafSlab(second_, limit_, frame_.error());
    }
    Vector4x3 corners[3];
    gatherLeaf(in_.tree1.slots(), in_.tree1.positions(), a, corners);
    return pairs & ~(0x1111 * slab_.apart(corners));
  }
  /// Adds pairs of triangles of two leaves to the batch, untested.
  ADAPTIVE_BVH_INLINE void addPairs(const WideNode& a, const WideNode& b, unsigned pairs) {
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs);
      pairs_[size_] = {static_cast<unsigned>(a.first + (bit & 3)),
                       static_cast<unsigned>(b.first + (bit >> 2))};
      verdicts_[size_++] = kOpen;
    }
  }
  /// Removes pairs of the batch that are certainly apart along an axis. All others are still open.
  void testAlongAxes() {
    const PairSource from = sourceOf(in_);
    size_ = keepByNormals(from, pairs_, size_, errors_);
    PairVerdict verdicts[Sink::kBatch];
    pairTests().judge(from, pairs_, size_, errors_.fine, verdicts);
    int kept = 0;
    for (int i = 0; i < size_; ++i) {
      pairs_[kept] = pairs_[i];
      kept += verdicts[i] != PairVerdict::Apart;
    }
    size_ = kept;
  }

  /// Decides about all pairs of the batch, and passes the near ones to the sink.
  void testAll() {
    if constexpr (Sink::kTakesUndecided) {
      for (int i = 0; i < size_; ++i) sink_.add(pairs_[i], nullptr);
      size_ = 0;
      return;
    }
    if (isTaken(Shortcut::SinglePrecision)) {
      if constexpr (kByAxes) testAlongAxes();
      testOpen();
    }
    for (int i = 0; i < size_ && !sink_.isDone(); ++i) settle(pairs_[i], verdicts_[i]);
    size_ = 0;
    batch_ = std::min(2 * batch_, Sink::kBatch);
  }

  /// Tests the undecided pairs of the batch by edges and faces.
  void testOpen() {
    int open[Sink::kBatch + 3], count = 0;  // indices of these pairs; repeated up to groups of four
    for (int i = 0; i < size_; ++i) {
      open[count] = i;
      count += verdicts_[i] == kOpen;
    }
    for (int i = count; i % 4; ++i) open[i] = open[count - 1];
    for (int i = 0; i < count; i += 4) {
      const std::array<int, 4> at = {open[i], open[i + 1], open[i + 2], open[i + 3]};
      const LeafIndexPair group[4] = {pairs_[at[0]], pairs_[at[1]], pairs_[at[2]], pairs_[at[3]]};
      setVerdicts(distances(group).byFeatures(limit_), at);
    }
  }
  ADAPTIVE_BVH_INLINE void setVerdicts(const Nearness4& nearness, const std::array<int, 4>& at) {
    for (std::size_t k = 0; k < 4; ++k)
      verdicts_[at[k]] = static_cast<std::uint8_t>((nearness.near >> k & 1) * kNear +
                                                   (nearness.apart >> k & 1) * kApart);
  }

  /// Passes a pair with this verdict to the sink if it is near. Decides about open pairs exactly.
  ADAPTIVE_BVH_INLINE void settle(const LeafIndexPair& pair, std::uint8_t verdict) {
    if (verdict == kApart) return;
    if (Sink::kTakesOpen || (verdict == kNear && !sink_.needsGap()))
      return sink_.add(pair, nullptr);
    const TrianglePoints p = in_.pointsOfFirst(pair.first), q = in_.pointsOfSecond(pair.second);
    if (kByAxes && isTaken(Shortcut::SinglePrecision) && areSurelyFarther(p, q, in_.distance))
      return;
    TriangleGap gap = gapOf(p, q);
    if (verdict != kNear && !nearness_.areNear(gap.distance, p, q)) return;
    gap.distance = std::min(gap.distance, in_.distance);  // it may be larger by rounding
    sink_.add(pair, &gap);
  }

  /// Returns four pairs, in the coordinates of the first tree.
  ADAPTIVE_BVH_INLINE TriangleDistances4 distances(const LeafIndexPair (&group)[4]) const {
    Vector4x3 p[3], q[3];
    gatherCorners(in_, frame_, group, p, q);
    return {TriangleDistances4::Seen(p), q, frame_.error()};
  }

  const PairInput& in_;
  const Frame& frame_;
  Sink& sink_;
  const float limit_;  ///< the distance in the first tree's unit
  const PairErrors errors_;
  const ExactNearness nearness_;
  const WideNode *first_leaf_ = nullptr, *second_leaf_ = nullptr;  ///< the leaves that were read
  TriangleDistances4::Seen first_;                                 ///< triangles of first_leaf_
  Vector4x3 second_[3];                                            ///< corners of second_leaf_
  LeafSlab slab_;                                                  ///< around them; with kByAxes
  LeafIndexPair pairs_[Sink::kBatch + 1];                          ///< the batch, of `size_` pairs
  std::uint8_t verdicts_[Sink::kBatch];
  int size_ = 0;
  int batch_ = Sink::kStopsAtFirst ? kFirstBatch : Sink::kBatch;  ///< pairs tested together
};

/// A search on one thread that passes all near pairs to a sink.
template <typename Frame, typename Sink>
using WithinSearch = TriangleSearch<WithinTests<Frame, Sink>>;

}  // namespace adaptive_bvh
