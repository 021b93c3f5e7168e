#pragma once

#include <limits>
#include <vector>

#include "query/box_pair.h"
#include "query/box_quad.h"
#include "query/node_separation.h"
#include "query/search_stops.h"

namespace adaptive_bvh {

/// The exact distance of two meshes: branch and bound on the boxes beside FCL's volumes, four by
/// four, the nearest pair first.
template <typename BV>
class DistanceVisitor {
 public:
  using S = typename BV::S;

  /// Both meshes must have boxes.
  DistanceVisitor(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                  NearestPair<BV>& nearest, SearchStops<BV>& stops);

  /// False when the objects are so far apart, for their sizes, that single precision will not do.
  bool isPossible() const { return boxes_.isPrecise(); }
  /// Searches everything below two nodes. The pairs where it stops cover that, each once. False
  /// when all searches have made so many tests of boxes before that was done.
  bool search(int node1, int node2, long most_box_tests = std::numeric_limits<long>::max());
  /// Goes on where that returned false.
  bool resume(long most_box_tests = std::numeric_limits<long>::max());

  NodeSeparation<BV>& separation() { return separation_; }
  const NodeSeparation<BV>& separation() const { return separation_; }
  long boxTests() const { return box_tests_; }

 private:
  using Nearest = NearestPair<BV>;
  /// Two nodes that are still to be searched, with the squared gap of their boxes: see BoxPair.
  struct Pair {
    CountedNode first, second;
    float gap;
  };
  /// Volumes are tested when the squared gap of the boxes is at least this share of the gap that
  /// prunes, and more than kFew triangles are below: with fewer it is as fast to split.
  static constexpr float kNear = 0.25f;
  static constexpr int kFew = 4;
  /// Of two boxes only the larger is split, when it is larger by this factor.
  static constexpr float kMuchLarger = 2;
  /// A node whose largest part is larger than this share of it does not become smaller by a split.
  static constexpr float kNoSmaller = 0.8f;

  static bool isSmall(const CountedNode& node) { return node.leaves <= BoxQuad::kSmall; }
  void visit(const Pair& pair);
  float gapOf(int node1, int node2);
  bool prune(const Pair& pair, S& separation);
  void split(const Pair& pair, S separation);
  void setQuads(const Pair& pair);
  ADAPTIVE_BVH_INLINE unsigned below(const Gaps4x4& gaps, float gap) const;
  void recordBelow(const Pair& pair, unsigned open);
  void push(const Pair& pair, const Gaps4x4& gaps, unsigned open);
  static VertexIndices cornersOf(const PlacedMesh<BV>& mesh, const BoxNodes<const BoxNode>& nodes,
                                 int leaf);
  void readFirst(unsigned lanes);
  void readSecond(int node);
  void testLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned open);
  void setLimit();
  void stopAtGap(int node1, int node2, float gap) {
    if (stops_.isKept()) stops_.add(node1, node2, boxes_.distanceFor(gap));
  }

  const PlacedMesh<BV> first_, second_;
  const BoxNodes<const BoxNode> nodes1_, nodes2_;
  NearestPair<BV>& nearest_;
  SearchStops<BV>& stops_;
  const PairStatistics visits_;
  const double unit1_;  // of the first model, per unit of its boxes
  const BoxPair boxes_;
  NodeSeparation<BV> separation_;
  S limit_ = std::numeric_limits<S>::quiet_NaN();  ///< as these two have it
  float limit2_ = 0;                               // as a squared gap of boxes: see BoxPair
  float nearly2_ = 0;  // a squared gap that would prune if boxes were exact
  std::vector<Pair>& open_;
  BoxQuad quad1_, quad2_;  // of the pair that is split
  int quad2_of_ = -1;
  bool quad2_alone_ = false;
  Boxes4 turned2_;              // quad2_ in the first frame
  Triangles4 block1_, block2_;  // of the pair of small nodes that is tested
  int block2_of_ = -1;
  fcl::Vector3d origin_;  // of the blocks, in the first model's coordinates
  VertexIndices corners1_[4], corners2_[4];
  long box_tests_ = 0;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class DistanceVisitor<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
