#pragma once

#include <vector>

#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "query/placed_boxes.h"
#include "query/recorder.h"
#include "query/triangle_pair.h"
#include "query/volume_separation.h"
#include "tree/adaptive_tree.h"

namespace adaptive_bvh {

/// One side of a query by boxes.
template <typename S>
struct BoxedMesh {
  const fcl::BVHModel<fcl::RSS<S>>* model;
  const AdaptiveTree<fcl::RSS<S>>* tree;
  fcl::Transform3<S> tf;
};

/// A pair of nodes where a search stopped: a lower bound of their distance, and all that could have
/// moved their triangles until then, which the models' boxes and the transforms have summed up
/// (Boxes::travelOf, RigidMotion). So the bound less what was added to those since bounds the
/// distance in a later frame. Three sums, for in one the small steps of one would be lost beside
/// another's size.
struct FrontPair {
  int node1, node2;
  float travel1, travel2;  ///< in body units
  double rigid;
  double bound;
};

/// Where a search leaves its front. Nowhere, by default.
struct FrontSink {
  std::vector<FrontPair>* pairs = nullptr;
  double rigid = 0;  ///< RigidMotion::sum
};

/// The exact distance of two meshes: a branch and bound over pairs of nodes like FCL's, but on the
/// boxes beside FCL's volumes, and with a cheap bound before each distance of two triangles. Fills
/// `result` as FCL's query does, by FCL's triangle distances.
template <typename S>
class BoxedDistance {
 public:
  /// `front` gets every pair of nodes at which the search stops, unless it ends with isDone.
  BoxedDistance(const BoxedMesh<S>& first, const BoxedMesh<S>& second,
                const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                const FrontSink& front = FrontSink());

  /// False when the objects are so far apart, for their sizes, that single precision will not do.
  bool isPossible() const { return relation_.isPrecise(); }

  /// Nothing can be nearer.
  bool isDone() const { return result_.min_distance <= 0; }

  /// The distance of two triangles as a first upper bound. Nothing when one of them does not exist.
  void seed(int triangle1, int triangle2);
  /// Whether all that was below the pair is surely not nearer than the limit. The sums are rounded
  /// up, so whatever moved shows in a difference; each is rounded once, relative to itself, and a
  /// few epsilon cover that and the sums here. Where nothing moved nothing is rounded either:
  /// between parallel faces many bounds equal the limit.
  bool isSettled(const FrontPair& pair) const {
    const double lost = (double(boxes1_.travelOf(pair.node1)) - double(pair.travel1)) * unit1_ +
                        (double(boxes2_.travelOf(pair.node2)) - double(pair.travel2)) * unit2_ +
                        (front_.rigid - pair.rigid);
    const auto limit = static_cast<double>(limit_);
    if (lost == 0) return pair.bound >= limit;
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return pair.bound >= (limit + lost) * (1 + kRounding) + rounding::tiny<double>();
  }
  /// Tests two nodes, and descends where that does not settle it.
  void visit(int node1, int node2);
  /// Whether the query found a smaller distance than `result` came with.
  bool improved() const { return improved_; }
  /// Of the search so far, in tests of boxes.
  double cost() const {
    return double(work_.box_tests) + 3 * double(work_.separation_tests) +
           5 * double(work_.leaf_tests);
  }
  /// To be called after the search. Counts it as a recorded query of both models.
  void finish();

 private:
  /// Volumes are asked where the squared gap of the boxes is at least this share of what would do,
  /// and more than so many triangles are below: with fewer it is as quick to go on.
  static constexpr float kNear = 0.25f;
  static constexpr int kFew = 8;

  /// `separation` of the volumes; NaN where it was not asked for.
  void descend(int node1, int node2, S separation);
  void splitFirst(int node1, int node2, S separation);
  void splitSecond(int node1, int node2, S separation);
  void recordChildGap(Evidence* side, int node, S separation, const float (&gaps)[2]) const;
  void settle(int node1, int node2, float gap);
  void goOn(const int (&pairs)[2][2], const float (&gaps)[2]);
  void testLeaves(int leaf1, int leaf2);
  void improve(S distance, int triangle1, int triangle2, const fcl::Vector3<S>& on1,
               const fcl::Vector3<S>& on2);
  void setLimit();
  void stop(int node1, int node2, double bound) {
    if (front_.pairs)
      front_.pairs->push_back(
          {node1, node2, boxes1_.travelOf(node1), boxes2_.travelOf(node2), front_.rigid, bound});
  }

  const BoxedMesh<S> first_, second_;
  const std::vector<Corners>&corners1_, &corners2_;
  const Boxes<S>&boxes1_, &boxes2_;
  const fcl::DistanceRequest<S>& request_;
  fcl::DistanceResult<S>& result_;
  FrontSink front_;
  const Recorder recorder_;
  double unit1_, unit2_;  ///< of the models, per unit of their boxes
  BoxRelation relation_;
  TrianglePair<S> triangles_;
  VolumeSeparation<S> volumes_;
  S limit_;           ///< distances from here on do not matter
  float limit2_ = 0;  ///< as a squared gap of boxes: see BoxRelation
  bool improved_ = false;
  QueryWork work_;
};

}  // namespace adaptive_bvh
