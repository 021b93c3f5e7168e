#pragma once

#include <limits>
#include <vector>

#include "geometry/triangle_block.h"
#include "geometry/triangle_separation.h"
#include "query/box_pair.h"
#include "query/box_quad.h"
#include "query/line_separation.h"
#include "query/placed_mesh.h"
#include "query/vertex_separation.h"
#include "volume/each_volume.h"
#include "volume/volume_separation.h"

namespace adaptive_bvh {

/// A pair of nodes where a search stopped: a lower bound of their distance, and the three sums of
/// motion as they stood then (MotionBounds of either model, RigidMotion). The bound less what has
/// been added to these sums bounds the distance in a later step. They are kept apart: in one sum,
/// small steps of one would be lost beside the size of another.
struct FrontPair {
  int node1, node2;
  float motion1, motion2;  ///< accumulated, in body units
  double rigid;
  double bound;
};

/// The exact distance of two meshes: branch and bound on the boxes beside FCL's volumes, four by
/// four, the nearest pair first, with a cheap bound before each distance of two triangles. Fills
/// the result as FCL's query does, by FCL's triangle distances.
template <typename BV>
class DistanceVisitor {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;

  /// Both meshes must have boxes. `rigid_motion`: RigidMotion::sum, of a query with a front.
  DistanceVisitor(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                  const DistanceQuery<S>& query, double rigid_motion = 0);

  /// False when the objects are so far apart, for their sizes, that single precision will not do.
  bool isPossible() const { return boxes_.isPrecise(); }
  /// To be called first, when it only matters whether the distance is at most `enough`: the search
  /// ends with the first such pair. Distances of triangles are then our own, not FCL's.
  void stopAt(S enough) {
    enough_ = enough;
    is_own_ = true;
  }
  /// The distance of two triangles as a first upper bound. Nothing when one of them does not exist.
  void addWitness(int triangle1, int triangle2);
  /// From now on, adds the pairs at which a search stops to `pairs`; those that it comes to from
  /// one in `every` of the pairs that it visits.
  void keepStops(std::vector<FrontPair>& pairs, std::size_t every) {
    stops_ = &pairs;
    every_ = every;
    until_kept_ = 1;  // the first: there may be no others
  }
  /// Searches everything below two nodes. The pairs where it stops cover that, each once.
  void search(int node1, int node2);

  /// True: nothing below a pair of an earlier front is nearer than the limit. The sums are rounded
  /// up, so every motion shows in a difference. Each difference is rounded once, relative to
  /// itself; 16 epsilon cover that and the sums here. When nothing moved, nothing is rounded, and
  /// the bound is compared as it was: between parallel faces many bounds equal the limit.
  bool isStillPruned(const FrontPair& pair) const {
    const double lost =
        (double(motion1_.accumulatedMotion(pair.node1)) - double(pair.motion1)) * unit1_ +
        (double(motion2_.accumulatedMotion(pair.node2)) - double(pair.motion2)) * unit2_ +
        (rigid_motion_ - pair.rigid);
    const auto limit = static_cast<double>(limit_);
    if (lost == 0) return pair.bound >= static_cast<double>(limitWithinRounding());
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return pair.bound >= (limit + lost) * (1 + kRounding) + rounding::tiny<double>();
  }

  /// The distance is 0, so nothing can be nearer; or small enough.
  bool isDone() const { return result_.min_distance <= enough_; }

  /// To be called after the search. Counts it as a recorded query of both models. Returns whether
  /// it found a smaller distance than `result` came with.
  bool finish();
  /// Cost of the search so far, in tests of boxes.
  double cost() const {
    return double(work_.box_tests) + 12 * double(work_.separation_tests) +
           40 * double(work_.leaf_tests) + 0.1 * double(vertices_.read());
  }

 private:
  /// Two nodes that are still to be searched, with the squared gap of their boxes: see BoxPair.
  struct Pair {
    CountedNode first, second;
    float gap;
  };
  /// Volumes are tested when the squared gap of the boxes is at least this share of the gap that
  /// prunes, and more than kFew triangles are below: with fewer it is as fast to split.
  static constexpr float kNear = 0.25f;
  static constexpr int kFew = 4;
  /// Volumes that prune up to this share of the limit may do so with exact positions.
  static constexpr double kNearly = 63. / 64;
  /// Of two boxes only the larger is split, when it is larger by this factor.
  static constexpr float kMuchLarger = 2;
  /// A node whose largest part is larger than this share of it does not become smaller by a split.
  static constexpr float kNoSmaller = 0.8f;

  static bool isSmall(const CountedNode& node) { return node.leaves <= BoxQuad::kSmall; }
  /// Of pairs of lanes, bit 4 j + i for i of the first: the lanes of either side.
  static unsigned firstLanes(unsigned pairs) {
    return (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
  }
  static unsigned secondLanes(unsigned pairs) {
    return unsigned((pairs & 0x000f) != 0) | unsigned((pairs & 0x00f0) != 0) << 1 |
           unsigned((pairs & 0x0f00) != 0) << 2 | unsigned((pairs & 0xf000) != 0) << 3;
  }

  void visit(const Pair& pair);
  float gapOf(int node1, int node2);
  bool prune(const Pair& pair, S& separation);
  S separationOf(int node1, int node2);
  /// What is nearer than the limit by no more than FCL's distances of triangles are rounded is as
  /// near: so parallel faces prune. Not where that would hide a touch.
  S limitWithinRounding() const { return limit_ > 4 * rounding_ ? limit_ - rounding_ : limit_; }
  bool mayReadVertices(const Pair& pair, S separation) const;
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
  void stopAtLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned open, double* least);
  double testTriangles(int i, int j, double bound, double slack);
  S distanceOf(const VertexIndices& a, const VertexIndices& b, Point& on1, Point& on2) const {
    return is_own_ ? triangles_.nearestDistance(a, b, on1, on2)
                   : triangles_.distance(a, b, on1, on2);
  }
  void improve(S distance, int triangle1, int triangle2, const Point& on1, const Point& on2);
  void setLimit();
  /// `bound` bounds the distance below two nodes.
  void stop(int node1, int node2, double bound) {
    stops_->push_back({node1, node2, motion1_.accumulatedMotion(node1),
                       motion2_.accumulatedMotion(node2), rigid_motion_, bound});
  }
  void stopAtGap(int node1, int node2, float gap) {
    if (is_kept_) stop(node1, node2, boxes_.distanceFor(gap));
  }

  const PlacedMesh<BV> first_, second_;
  const BoxNodes<const BoxNode> nodes1_, nodes2_;
  const MotionBounds<S>&motion1_, &motion2_;
  const fcl::DistanceRequest<S>& request_;
  fcl::DistanceResult<S>& result_;
  const double rigid_motion_;
  std::vector<FrontPair>* stops_ = nullptr;
  std::size_t every_ = 1, until_kept_ = 0;
  bool is_kept_ = false;  ///< whether stops at the pair that is visited are kept
  const PairStatistics statistics_;
  const double unit1_, unit2_;  // of the models, per unit of their boxes
  const BoxPair boxes_;
  TriangleSeparation<S> triangles_;
  VertexSeparation<BV> vertices_;
  /// FCL's volumes may be read: none waits to be brought up to date.
  const bool has_volumes_;
  const VolumeSeparation<BV> volumes_;
  LineSeparation<BV> line_;
  const S rounding_;   // of FCL's distance of two triangles
  S limit_;            // distances from here on do not matter
  float limit2_ = 0;   // as a squared gap of boxes: see BoxPair
  float nearly2_ = 0;  // a squared gap that would prune if boxes were exact
  bool improved_ = false;
  S enough_ = 0;         ///< a distance that ends the search
  bool is_own_ = false;  ///< distances of triangles are ours
  std::vector<Pair>& open_;
  BoxQuad quad1_, quad2_;  // of the pair that is split
  int quad2_of_ = -1;
  bool quad2_alone_ = false;
  Boxes4 turned2_;              // quad2_ in the first frame
  Triangles4 block1_, block2_;  // of the pair of small nodes that is tested
  int block2_of_ = -1;
  fcl::Vector3d origin_;  // of the blocks, in the first model's coordinates
  VertexIndices corners1_[4], corners2_[4];
  QueryWork work_;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class DistanceVisitor<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
