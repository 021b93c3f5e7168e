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
/// (NodeGrowth::travel, RigidTravel). So the bound less what was added to that since bounds the
/// distance in a later frame.
struct FrontPair {
  int node1, node2;
  double bound, travel;
};

/// Where a search leaves its front. Nowhere, by default.
struct FrontSink {
  std::vector<FrontPair>* pairs = nullptr;
  double rigid_travel = 0;
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
  /// Whether all that was below the pair is surely not nearer than the limit. Where nothing moved
  /// nothing is rounded either: between parallel faces many bounds equal the limit.
  bool isSettled(const FrontPair& pair) const {
    constexpr double kRounding = 1e-14;  // of the sums and differences here
    const double travel = travelOf(pair.node1, pair.node2), since = travel - pair.travel;
    const double lost = since > 0 ? since + kRounding * (pair.bound + travel) : 0;
    return pair.bound - lost >= static_cast<double>(limit_);
  }
  /// Tests two nodes, and descends where that does not settle it.
  void visit(int node1, int node2);
  /// Whether the query found a smaller distance than `result` came with.
  bool improved() const { return improved_; }
  /// Of the search so far, in tests of boxes.
  double cost() const {
    return double(box_tests) + 3 * double(volume_tests) + 5 * double(leaf_tests);
  }
  /// To be called after the search. Counts it as a recorded query of both models.
  void finish();

  long box_tests = 0, volume_tests = 0, leaf_tests = 0;

 private:
  /// Volumes are asked where the squared gap of the boxes is at least this share of what would do,
  /// and more than so many triangles are below: with fewer it is as quick to go on.
  static constexpr float kNear = 0.25f;
  static constexpr int kFew = 8;

  void descend(int node1, int node2);
  void splitFirst(int node1, int node2);
  void splitSecond(int node1, int node2);
  void settle(int node1, int node2, float gap);
  void goOn(const int (&pairs)[2][2], const float (&gaps)[2]);
  void testLeaves(int leaf1, int leaf2);
  void improve(S distance, int triangle1, int triangle2, const fcl::Vector3<S>& on1,
               const fcl::Vector3<S>& on2);
  void setLimit();
  void stop(int node1, int node2, double bound) {
    if (front_.pairs) front_.pairs->push_back({node1, node2, bound, travelOf(node1, node2)});
  }

  double travelOf(int node1, int node2) const {
    return static_cast<double>(boxes1_.growthOf(node1).travel) * unit1_ +
           static_cast<double>(boxes2_.growthOf(node2).travel) * unit2_ + front_.rigid_travel;
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
};

}  // namespace adaptive_bvh
