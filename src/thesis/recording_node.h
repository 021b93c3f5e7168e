#pragma once

#include <algorithm>
#include <limits>

#include "thesis/traversal_statistics.h"

namespace adaptive_bvh {

/// An FCL distance traversal node (`Node`) that also records statistics of one query, for the
/// fitness tests (refit.h). The results are FCL's. One object serves one query, on one thread.
///
/// FCL's distanceRecurse makes the following calls, which provide all data for test C (thesis
/// 4.4.3):
///   canStop(D)               if false, the traversal enters the pair (B1, B2), whose distance is D
///   firstOverSecond(B1, B2)  which of the two is split; say B1, into A1 and C1
///   BVTesting(A1, B2)        returns the distance D_a
///   BVTesting(C1, B2)        returns the distance D_c
/// alpha = D_a - D, beta = D_c - D. FCL never tests the pair of roots, so for this pair there is no
/// D, and nothing is recorded for test C.
template <typename Node>
class RecordingDistanceNode : public Node {
 public:
  /// `of_node` are the constructor arguments of the node.
  template <typename... Args>
  explicit RecordingDistanceNode(const PairStatistics& statistics, const Args&... of_node)
      : Node(of_node...), statistics_(statistics) {}
  ~RecordingDistanceNode() override { statistics_.recordQuery(work_); }

  bool canStop(double distance) const override {
    parent_distance_ = distance;
    return Node::canStop(distance);
  }

  bool firstOverSecond(int b1, int b2) const override {
    statistics_.recordVisit(b1, b2);
    const bool first = Node::firstOverSecond(b1, b2);
    split_side_ = statistics_.side[first ? 0 : 1];
    split_node_ = first ? b1 : b2;
    first_child_distance_ = kNone;
    return first;
  }

  double BVTesting(int b1, int b2) const override {
    ++work_.bv_tests;
    const double distance = Node::BVTesting(b1, b2);
    if (first_child_distance_ == kNone)
      first_child_distance_ = distance;
    else if (split_side_)
      split_side_->recordChildGap(split_node_,
                                  std::min(first_child_distance_, distance) - parent_distance_);
    return distance;
  }

  void leafTesting(int b1, int b2) const override {
    ++work_.leaf_tests;
    statistics_.recordVisit(b1, b2);
    Node::leafTesting(b1, b2);
  }

 private:
  static constexpr double kNone = -1;  // distances are never negative

  // Mutable, because FCL's functions are const.
  PairStatistics statistics_;
  mutable QueryWork work_;
  mutable double parent_distance_ =
      std::numeric_limits<double>::quiet_NaN();        ///< D; NaN for the roots
  mutable double first_child_distance_ = kNone;        ///< D_a
  mutable TraversalStatistics* split_side_ = nullptr;  ///< statistics of the split node's model
  mutable int split_node_ = 0;                         ///< B1 if it is the one that is split
};

/// Records statistics of FCL's collisionRecurse. Its tests only report whether volumes are
/// disjoint, so nothing is recorded for test C.
template <typename Node>
class RecordingCollisionNode : public Node {
 public:
  explicit RecordingCollisionNode(const PairStatistics& statistics) : statistics_(statistics) {}
  ~RecordingCollisionNode() override { statistics_.recordQuery(work_); }

  using Node::BVTesting;
  bool BVTesting(int b1, int b2) const override {
    ++work_.bv_tests;
    const bool disjoint = Node::BVTesting(b1, b2);
    if (!disjoint) statistics_.recordVisit(b1, b2);
    return disjoint;
  }

  using Node::leafTesting;
  void leafTesting(int b1, int b2) const override {
    ++work_.leaf_tests;
    Node::leafTesting(b1, b2);
  }

 private:
  PairStatistics statistics_;
  mutable QueryWork work_;
};

}  // namespace adaptive_bvh
