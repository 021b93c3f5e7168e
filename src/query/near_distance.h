#pragma once

#include <algorithm>
#include <cmath>

#include "query/node_separation.h"
#include "query/pair_corners.h"
#include "query/relative_frame.h"
#include "query/search_stops.h"
#include "query/wide_search.h"
#include "query/wide_trees.h"

namespace adaptive_bvh {

/// What gaps of boxes say, of two four-wide trees with the same coordinates. Boxes reach farther
/// than their triangles by more than all that is rounded in both and in their differences, but for
/// the squares': docs/bounds.md, 13.
class CommonGaps {
 public:
  /// `scale`: WideTree::scale.
  explicit CommonGaps(double scale) : scale_(scale) {}

  /// Two nodes whose squared gap is at least this are at least `distance` apart.
  float squaredGapFor(double distance) const {
    const double gap = distance * scale_;
    constexpr double kLeast = 1e-30;  // squares of smaller gaps underflow
    return static_cast<float>(std::clamp(gap * gap * (1 + kSquares), kLeast, 1e38));
  }
  /// Those with a smaller one are nearer than `distance`, or their boxes are loose.
  float squaredGapNear(double distance) const {
    const double gap = std::max(0., distance * scale_ - kReach);
    return static_cast<float>(std::min(gap * gap, 1e38));
  }
  /// Two nodes with this squared gap are at least so far apart; not negative.
  double distanceFor(float squared_gap) const {
    return std::sqrt(static_cast<double>(squared_gap)) * (1 - kSquares) / scale_;
  }

 private:
  static constexpr double kSquares = 1. / (1 << 20);
  static constexpr double kReach = 4 * double(WideTree<double>::kBoxMargin);
  double scale_;
};

/// The distance of two meshes that nearly touch, where many boxes are to be tested: branch and
/// bound like DistanceVisitor's, on four-wide trees. In common coordinates no box grows by being
/// turned, and four by four are read as they stand. But such trees are to be brought up to date
/// first.
template <typename BV>
class NearDistance {
 public:
  using S = typename BV::S;

  /// False where the trees could not have the same coordinates. Nor in single precision, where
  /// FCL's placement of the second model is off by more than the boxes have to spare.
  static bool canBe(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                    const NearestPair<BV>& nearest) {
    if (!std::is_same<S, double>::value) return false;
    return canShareCoordinates(first, second, nearest.triangles().R(), nearest.triangles().T());
  }
  /// So many tests of boxes take as long as to bring the trees up to date.
  static long worthAfter(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second);

  NearDistance(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second, NearestPair<BV>& nearest,
               SearchStops<BV>& stops, NodeSeparation<BV>& separation);

  /// False when the trees have not got the same coordinates.
  bool isPossible() const { return frame_.isSame(); }
  /// All pairs of triangles.
  void search();
  /// Those below two of FCL's nodes, where an earlier search of this class stopped. False when one
  /// did not, and nothing was done.
  bool search(int node1, int node2);
  /// To be called in the end: records the nodes that were visited.
  void record() const;
  long boxTests() const { return box_tests_; }

 private:
  /// Two nodes that are still to be searched, with the squared gap of their boxes.
  struct Pair {
    int first, second;
    float gap;
  };
  /// Other bounds than boxes' are tried when the squared gap is at least this share of the limit's.
  static constexpr float kNear = 0.25f;

  void setLimit();
  bool prune(const Pair& pair);
  void run();
  void visit(const Pair& pair, unsigned pairs = 0xffff);
  void push(const Pair& pair, const Gaps4x4& gaps, unsigned pairs);
  unsigned stopAtRows(const Pair& pair, const Gaps4x4& gaps);
  void testLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned pairs, unsigned open);
  void keepStops(const Pair& pair, unsigned lanes, const double (&least)[4]);
  void stopAtGap(const Pair& pair);
  static MeshTriangle triangle(const WideTree<S>& tree, const WideNode& leaf, int lane);
  void readSecond(int leaf);

  const PlacedMesh<BV>&first_, &second_;
  NearestPair<BV>& nearest_;
  SearchStops<BV>& stops_;
  NodeSeparation<BV>& separation_;
  const WideTrees<S> trees_;
  const RelativeFrame<S> frame_;
  const CommonGaps gaps_;
  const WideNode *const nodes1_, *const nodes2_;
  std::vector<Pair>& open_;
  VisitedNodes visited1_, visited2_;
  S limit_ = std::numeric_limits<S>::quiet_NaN();  ///< as `nearest_` has it
  float limit2_ = 0, nearly2_ = 0;                 ///< as squared gaps
  Vector4x3 direction_;                            ///< between the nearest points
  /// Of the second leaf that is tested: corners from an origin beside them.
  Triangles4 block2_;
  TriangleSides side2_;
  Origin4 origin_;
  int block2_of_ = -1;
  long box_tests_ = 0;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class NearDistance<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
