#pragma once

#include <algorithm>

#include "adaptive_bvh/self_collision.h"
#include "geometry/triangle_differences.h"
#include "query/flat_patches.h"
#include "query/pair_corners.h"

namespace adaptive_bvh {

/// What CandidateTests is given of a query. Models, trees and placement are those of FCL's
/// traversal node: R and T place the second model in the first's coordinates.
template <typename BV>
struct CandidateInput {
  using S = typename BV::S;
  const PlacedMesh<BV>&first, &second;
  const WideTree<S>&tree1, &tree2;
  const fcl::Matrix3<S>& R;
  const fcl::Vector3<S>& T;
  NeighbourFilter filter;
  const FlatPatches<S>* flat;  ///< of a query of one tree with itself; or none
};

/// Tests pairs of triangles whose boxes overlap. Neighbours are left out; the others are collected,
/// and by the hundred those are left out that are surely apart, four or eight at a time: first by
/// their planes and edges, then by all axes of FCL's test. Where both trees have the same
/// coordinates, positions and residuals serve for all of it (pair_stages.h); else the last look is
/// at the model's own positions.
/// FCL's test decides about the few of which that is uncertain.
///
///   frame(points)            points of the second tree in the coordinates of the first
///   node.test(i, j)          FCL's test of two triangles, by their indices; adds their contacts
///   node.add(i, j)           adds the contacts of two that it would find touching
///   node.isDone()            whether there are contacts enough
template <typename BV, typename Frame, typename Node>
class CandidateTests {
 public:
  using S = typename BV::S;
  using Input = CandidateInput<BV>;
  using BoxFrame = Frame;

  static const Frame& boxFrame(const Input&, const Frame& frame) { return frame; }

  CandidateTests(const CandidateInput<BV>& input, const Frame& frame, Node& node)
      : in_(input),
        frame_(frame),
        node_(node),
        errors_(pairErrors<S>(frame, input.tree1.scale(), 0)) {}

  ADAPTIVE_BVH_INLINE void foundLeaves(const WideNode& a, const WideNode& b, unsigned pairs) {
    candidates_ += packs::countOf16(pairs);
    if (size_ > kSize - 16) testAll();
    pairs = withoutNeighbours(pairs, in_.tree1, a, in_.tree2, b, in_.filter);
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs);
      pairs_[size_++] = {static_cast<unsigned>(a.first + (bit & 3)),
                         static_cast<unsigned>(b.first + (bit >> 2))};
    }
  }
  void foundLeaf(const WideNode& a, unsigned pairs) { foundLeaves(a, a, pairs); }
  bool isDone() const { return is_done_; }
  /// Whether no pair of triangles below a node is worth to be found, in a search of one tree.
  bool isFlat(int node) const { return in_.flat && in_.flat->contains(node); }
  /// Contacts are added to those that a result has.
  static void clear() {}
  /// Goes on with more pairs, whether or not there were contacts enough.
  void begin() { is_done_ = node_.isDone(); }
  /// What was found and not yet tested.
  void finish() { testAll(); }

  long candidates() const { return candidates_; }
  long leafTests() const { return fcl_tests_; }

 private:
  static constexpr int kSize = 256;

  void testAll() {
    if constexpr (Frame::kIsIdentity)
      testWithResiduals();
    else
      testInBothCoordinates();
    size_ = 0;
  }

  /// Both trees have the same coordinates: their positions with residuals are as good as the
  /// model's own.
  void testWithResiduals() {
    constexpr int kAtOnce = 32;  // there may soon be contacts enough
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
      const LeafPair group[4] = {pairs_[i], pairs_[i + 1], pairs_[i + 2], pairs_[i + 3]};
      const PairVerdicts verdicts = inModel(group).verdicts(errors_.fine);
      for (int k = 0; k < 4 && i + k < size_ && !is_done_; ++k)
        settle(pairs_[i + k], verdicts.apart >> k & 1, verdicts.touching >> k & 1);
    }
  }

  void settle(const LeafPair& pair, bool apart, bool touching) {
    if (apart) return;
    const int i = in_.tree1.triangle(pair.first), j = in_.tree2.triangle(pair.second);
    if (touching) {
      node_.add(i, j);
    } else {
      ++fcl_tests_;
      node_.test(i, j);
    }
    is_done_ = node_.isDone();
  }

  /// Keeps the pairs that `areApart` does not name, in order; returns how many.
  template <typename AreApart>
  ADAPTIVE_BVH_INLINE int keep(const AreApart& areApart) {
    int kept = 0;
    for (int i = 0; i < size_; i += 4) {
      const LeafPair group[4] = {pairs_[i], pairs_[i + 1], pairs_[i + 2], pairs_[i + 3]};
      const unsigned apart = areApart(group);
      for (int k = 0; k < 4; ++k) {
        pairs_[kept] = group[k];
        kept += !(apart >> k & 1) & (i + k < size_);
      }
    }
    return kept;
  }

  /// In the coordinates of the first tree.
  ADAPTIVE_BVH_INLINE TrianglePairs4 coarse(const LeafPair (&group)[4]) const {
    Vector4x3 p[3], q[3];
    gatherCorners(in_, frame_, group, p, q);
    return TrianglePairs4(p, q);
  }

  /// From the model's own positions.
  TrianglePairs4 inModel(const LeafPair (&group)[4]) const {
    TriangleDifferences<S> differences(in_.tree1.scale());
    for (int k = 0; k < 4; ++k) {
      TrianglePoints<S> q = points(in_.second.model->vertices, in_.tree2, group[k].second);
      frame_.place(in_.R, in_.T, q);
      differences.set(k, points(in_.first.model->vertices, in_.tree1, group[k].first), q);
    }
    return differences.pairs();
  }
  ADAPTIVE_BVH_INLINE static TrianglePoints<S> points(const fcl::Vector3<S>* vertices,
                                                      const WideTree<S>& tree, unsigned triangle) {
    const Int4 v = tree.vertices(triangle);
    return {vertices[v[0]], vertices[v[1]], vertices[v[2]]};
  }
  const CandidateInput<BV> in_;
  const Frame& frame_;
  Node& node_;
  const PairErrors errors_;
  LeafPair pairs_[kSize + 3];
  int size_ = 0;
  bool is_done_ = false;
  long candidates_ = 0, fcl_tests_ = 0;
};

}  // namespace adaptive_bvh
