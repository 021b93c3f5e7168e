#pragma once

#include <vector>

#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "query/placed_boxes.h"
#include "query/triangle_pair.h"
#include "tree/adaptive_tree.h"

namespace adaptive_bvh {

/// One side of a query by boxes.
template <typename S>
struct BoxedMesh {
  const fcl::BVHModel<fcl::RSS<S>>* model;
  const AdaptiveTree<fcl::RSS<S>>* tree;
  fcl::Transform3<S> tf;
};

/// A pair of nodes where a descent stopped.
struct FrontPair {
  int node1, node2;
  double bound;  ///< their distance is at least this
};

/// The exact distance of two meshes: a branch and bound over pairs of nodes like FCL's, but on the
/// boxes beside FCL's volumes, and with a cheap bound before each distance of two triangles. Fills
/// `result` as FCL's query does, by FCL's triangle distances.
template <typename S>
class BoxedDistance {
 public:
  /// `front`, where given, gets every pair of nodes at which a descent stops.
  BoxedDistance(const BoxedMesh<S>& first, const BoxedMesh<S>& second,
                const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                std::vector<FrontPair>* front = nullptr);

  /// False when the objects are so far apart, for their sizes, that single precision will not do.
  bool isPossible() const { return relation_.isPrecise(); }

  /// Distances from here on do not matter.
  S limit() const { return limit_; }
  bool isDone() const { return result_.min_distance <= 0; }

  /// The distance of two triangles as a first upper bound.
  void seed(unsigned triangle1, unsigned triangle2);
  /// Everything below two nodes whose distance may matter.
  void descend(int node1, int node2);
  /// Tests two nodes, and descends where that does not settle it.
  void visit(int node1, int node2);
  /// Whether the query found a smaller distance than `result` came with.
  bool improved() const { return improved_; }
  /// To be called last.
  void finish();

  long box_tests = 0, leaf_tests = 0;

 private:
  void splitFirst(int node1, int node2);
  void splitSecond(int node1, int node2);
  void goOn(const int (&pairs)[2][2], const float (&gaps)[2]);
  void testLeaves(int leaf1, int leaf2);
  void improve(S distance, unsigned triangle1, unsigned triangle2, const fcl::Vector3<S>& on1,
               const fcl::Vector3<S>& on2);
  void setLimit();
  void stop(int node1, int node2, double bound) {
    if (front_) front_->push_back({node1, node2, bound});
  }

  const BoxedMesh<S> first_, second_;
  const Topology &topology1_, &topology2_;
  const Boxes<S>&boxes1_, &boxes2_;
  const fcl::DistanceRequest<S>& request_;
  fcl::DistanceResult<S>& result_;
  std::vector<FrontPair>* front_;
  BoxRelation relation_;
  TrianglePair<S> triangles_;
  S limit_;
  float limit2_ = 0;  ///< as a squared gap of boxes: see BoxRelation
  bool improved_ = false;
};

}  // namespace adaptive_bvh
