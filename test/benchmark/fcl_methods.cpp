// What FCL itself offers for a deforming mesh.
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>
#include <fcl/narrowphase/distance.h>

#include "fcl_support.h"
#include "method.h"

namespace adaptive_bvh_bench {
namespace {

enum class Refit { TopDown, BottomUp, Rebuild };

/// `Node`: the traversal that fcl::distance uses for BV; here for counting only.
template <typename BV, typename Node>
class FclPair : public Method {
 public:
  FclPair(const scenarios::Scenario& scenario, Refit refit) : refit_(refit) {
    fillModel(scenario.first.mesh(), first_);
    fillModel(scenario.second.mesh(), second_);
  }

  void update(const Frame& frame) override {
    move(first_, frame.first);
    move(second_, frame.second);
  }

  double distance(const Frame& frame) override {
    fcl::DistanceResultd result;
    return fcl::distance(&first_, frame.tf1, &second_, frame.tf2, fcl::DistanceRequestd(), result);
  }

  Work work(const Frame& frame) override {
    fcl::DistanceResultd result;
    Work work = countedDistance<Node>(first_, second_, frame, result);
    work.refitted = first_.getNumBVs() + second_.getNumBVs();
    return work;
  }

  std::size_t bytes() const override { return fclBytes(first_) + fclBytes(second_); }

 protected:
  void move(fcl::BVHModel<BV>& model, const Positions& positions) {
    model.beginReplaceModel();
    model.replaceSubModel(positions);
    model.endReplaceModel(refit_ != Refit::Rebuild, refit_ == Refit::BottomUp);
  }

  fcl::BVHModel<BV> first_, second_;

 private:
  Refit refit_;
};

/// AABBs as an expert would use them: fcl::distance copies both models on every call, and rebuilds
/// one that does not stand at the identity; the traversal itself needs no copies where both are
/// kept in world coordinates. And the pair of triangles that was nearest in the last frame gives a
/// first bound.
class ExpertAabbPair
    : public FclPair<fcl::AABBd, fcl::detail::MeshDistanceTraversalNode<fcl::AABBd>> {
 public:
  using Node = fcl::detail::MeshDistanceTraversalNode<fcl::AABBd>;

  explicit ExpertAabbPair(const scenarios::Scenario& scenario)
      : FclPair<fcl::AABBd, Node>(scenario, Refit::BottomUp) {}

  void update(const Frame& frame) override {
    moveInWorld(first_, frame.first, frame.tf1);
    moveInWorld(second_, frame.second, frame.tf2);
  }

  double distance(const Frame& frame) override {
    fcl::DistanceResultd result;
    if (!seed(result)) return 0;
    last_ = countedDistance<Node>(first_, second_, frame, result);
    b1_ = result.b1;
    b2_ = result.b2;
    return result.min_distance;
  }

  Work work(const Frame&) override {
    Work work = last_;
    work.refitted = first_.getNumBVs() + second_.getNumBVs();
    return work;
  }

 private:
  void moveInWorld(fcl::BVHModel<fcl::AABBd>& model, const Positions& positions,
                   const fcl::Transform3d& tf) {
    if (tf.isApprox(fcl::Transform3d::Identity(), 0)) return move(model, positions);
    world_.resize(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) world_[v] = tf * positions[v];
    move(model, world_);
  }

  /// False when the seed touches already. A little above the seed's distance, so that the search
  /// finds the seed again at least.
  bool seed(fcl::DistanceResultd& result) {
    last_ = Work();
    if (b1_ < 0) return true;
    const auto corner = [](const fcl::BVHModel<fcl::AABBd>& model, int t, int k) -> const Point& {
      return model.vertices[model.tri_indices[t][k]];
    };
    Point p, q;
    const double d = fcl::detail::TriangleDistance<double>::triDistance(
        corner(first_, b1_, 0), corner(first_, b1_, 1), corner(first_, b1_, 2),
        corner(second_, b2_, 0), corner(second_, b2_, 1), corner(second_, b2_, 2), p, q);
    result.min_distance = d * (1 + 1e-12);
    return d > 0;
  }

  Positions world_;
  int b1_ = -1, b2_ = -1;
  Work last_;
};

template <typename BV, typename Node>
MethodKind row(std::string key, std::string title, Refit refit,
               MethodKind::Note note = MethodKind::Plain) {
  return {std::move(key), std::move(title), note, note != MethodKind::Wrong,
          [refit](const scenarios::Scenario& scenario) {
            return std::make_unique<FclPair<BV, Node>>(scenario, refit);
          }};
}

}  // namespace

std::vector<MethodKind> fclMethods() {
  using namespace fcl;          // NOLINT: names of its volumes
  using namespace fcl::detail;  // NOLINT: and of their traversals
  return {
      row<RSSd, MeshDistanceTraversalNodeRSSd>(kReference, "FCL RSS, top-down refit",
                                               Refit::TopDown),
      row<RSSd, MeshDistanceTraversalNodeRSSd>("fcl-rss-rebuild", "FCL RSS, rebuild",
                                               Refit::Rebuild),
      row<RSSd, MeshDistanceTraversalNodeRSSd>("fcl-rss-bottom-up", "FCL RSS, bottom-up (wrong)",
                                               Refit::BottomUp, MethodKind::Wrong),
      row<OBBRSSd, MeshDistanceTraversalNodeOBBRSSd>("fcl-obbrss", "FCL OBBRSS, top-down refit",
                                                     Refit::TopDown),
      row<kIOSd, MeshDistanceTraversalNodekIOSd>("fcl-kios", "FCL kIOS, bottom-up refit",
                                                 Refit::BottomUp, MethodKind::Slow),
      row<AABBd, MeshDistanceTraversalNode<AABBd>>("fcl-aabb", "FCL AABB, bottom-up refit",
                                                   Refit::BottomUp),
      {"expert-aabb", "the same, no copies, seeded", MethodKind::Plain, true,
       [](const scenarios::Scenario& scenario) {
         return std::make_unique<ExpertAabbPair>(scenario);
       }},
  };
}

}  // namespace adaptive_bvh_bench
