// This library: DeformableMesh, and AdaptiveBVHModel with either volume and with the nine rows of
// the thesis's Table 2.
#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "fcl_support.h"
#include "method.h"

namespace adaptive_bvh_bench {
namespace {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

/// By the boxes of meshes. They count nothing, and have no nodes of FCL's to refit.
class MeshPair : public Method {
 public:
  MeshPair(const scenarios::Scenario& scenario, bool coherently)
      : first_(scenario.first.mesh()),
        second_(scenario.second.mesh()),
        coherent_(first_, second_),
        coherently_(coherently) {}

  void update(const Frame& frame) override {
    first_.update(frame.first);
    second_.update(frame.second);
  }

  double distance(const Frame& frame) override {
    fcl::DistanceResultd result;
    const fcl::DistanceRequestd request;
    return coherently_
               ? coherent_.distance(frame.tf1, frame.tf2, request, result)
               : adaptive_bvh::distance(&first_, frame.tf1, &second_, frame.tf2, request, result);
  }

  Work work(const Frame&) override { return {}; }
  std::size_t bytes() const override { return first_.bytes() + second_.bytes(); }

 private:
  adaptive_bvh::DeformableMesh first_, second_;
  adaptive_bvh::CoherentDistance coherent_;
  bool coherently_;
};

/// By FCL's volumes. `Node`: the traversal that fcl::distance uses for BV; here for counting only.
template <typename BV, typename Node>
class ModelPair : public Method {
 public:
  ModelPair(const scenarios::Scenario& scenario, const RefitPolicy& policy, bool recorded)
      : first_(policy), second_(policy), recorded_(recorded) {
    fillModel(scenario.first.mesh(), first_);
    fillModel(scenario.second.mesh(), second_);
  }

  void update(const Frame& frame) override {
    first_.update(frame.first);
    second_.update(frame.second);
  }

  double distance(const Frame& frame) override {
    fcl::DistanceResultd result;
    const fcl::DistanceRequestd request;
    return recorded_
               ? adaptive_bvh::distance(&first_, frame.tf1, &second_, frame.tf2, request, result)
               : fcl::distance(&first_, frame.tf1, &second_, frame.tf2, request, result);
  }

  Work work(const Frame& frame) override {
    Work work;
    if (recorded_) {
      const adaptive_bvh::QueryWork recorded = first_.recordedWork();
      work.bv_tests = recorded.bv_tests;
      work.leaf_tests = recorded.leaf_tests;
    } else {
      fcl::DistanceResultd result;
      work = countedDistance<Node, BV>(first_, second_, frame, result);
    }
    work.refitted = first_.lastUpdate().refitted() + second_.lastUpdate().refitted();
    return work;
  }

  std::size_t bytes() const override {
    return fclBytes(first_) + fclBytes(second_) + first_.trackingBytes() + second_.trackingBytes();
  }

 private:
  adaptive_bvh::AdaptiveBVHModel<BV> first_, second_;
  bool recorded_;
};

using RssPair = ModelPair<fcl::RSSd, fcl::detail::MeshDistanceTraversalNodeRSSd>;
using ObbrssPair = ModelPair<fcl::OBBRSSd, fcl::detail::MeshDistanceTraversalNodeOBBRSSd>;

MethodKind meshRow(std::string key, std::string title, bool coherently) {
  return {std::move(key), std::move(title), MethodKind::Plain, false,
          [coherently](const scenarios::Scenario& scenario) {
            return std::make_unique<MeshPair>(scenario, coherently);
          }};
}

template <typename Pair = RssPair>
MethodKind row(std::string key, std::string title, const RefitPolicy& policy, bool recorded,
               MethodKind::Note note = MethodKind::Plain) {
  return {std::move(key), std::move(title), note, false,
          [policy, recorded](const scenarios::Scenario& scenario) {
            return std::make_unique<Pair>(scenario, policy, recorded);
          }};
}

}  // namespace

std::vector<MethodKind> adaptiveMethods() {
  const auto thesis = [](const char* key, FitnessCriterion criterion,
                         MethodKind::Note note = MethodKind::Plain) {
    return row(key, std::string("thesis: ") + toString(criterion), RefitPolicy::thesis(criterion),
               true, note);
  };
  const RefitPolicy policy;
  const auto of = [](FitnessCriterion criterion) {
    RefitPolicy by;
    by.criterion = criterion;
    return by;
  };
  return {
      meshRow("coherent", "DeformableMesh, CoherentDistance", true),
      meshRow("mesh", "DeformableMesh, adaptive_bvh::distance", false),
      row("recorded", "AdaptiveBVHModel, adaptive_bvh::distance", policy, true),
      row("drop-in", "AdaptiveBVHModel, fcl::distance", policy, false),
      row("drop-in-all", "AdaptiveBVHModel that refits all, fcl::distance",
          of(FitnessCriterion::RefitAll), false),
      row("recorded-ab", "AdaptiveBVHModel by tests A and B, adaptive_bvh::distance",
          of(FitnessCriterion::AB), true),
      row<ObbrssPair>("recorded-obbrss", "OBBRSS: adaptive_bvh::distance", policy, true,
                      MethodKind::Slow),
      row<ObbrssPair>("drop-in-obbrss", "OBBRSS: fcl::distance", policy, false, MethodKind::Slow),
      thesis("thesis-a", FitnessCriterion::A),
      thesis("thesis-b", FitnessCriterion::B),
      thesis("thesis-ab", FitnessCriterion::AB),
      thesis("thesis-bc", FitnessCriterion::BC, MethodKind::Slow),
      thesis("thesis-a-or-bc", FitnessCriterion::AOrBC),
      thesis("thesis-abc", FitnessCriterion::ABC, MethodKind::Slow),
      thesis("thesis-ab-or-bc", FitnessCriterion::ABOrBC),
      thesis("thesis-all", FitnessCriterion::RefitAll),
      thesis("thesis-none", FitnessCriterion::RefitNone, MethodKind::Slow),
  };
}

}  // namespace adaptive_bvh_bench
