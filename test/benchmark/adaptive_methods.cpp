// The thesis's nine rows with the parameters of its Table 2, and this library's own defaults, with
// either volume.
#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "fcl_support.h"
#include "method.h"

namespace adaptive_bvh_bench {
namespace {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

enum class Query { DropIn, Recorded, Coherent };

/// `Node`: the traversal that fcl::distance uses for BV; here for counting only.
template <typename BV, typename Node>
class AdaptivePair : public Method {
 public:
  AdaptivePair(const scenarios::Scenario& scenario, const RefitPolicy& policy, Query query)
      : first_(policy), second_(policy), coherent_(first_, second_), query_(query) {
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
    switch (query_) {
      case Query::DropIn:
        return fcl::distance<double>(&first_, frame.tf1, &second_, frame.tf2, request, result);
      case Query::Recorded:
        return adaptive_bvh::distance<double>(&first_, frame.tf1, &second_, frame.tf2, request,
                                              result);
      case Query::Coherent: return coherent_.distance(frame.tf1, frame.tf2, request, result);
    }
    return 0;
  }

  Work work(const Frame& frame) override {
    Work work;
    if (query_ != Query::DropIn) {
      const adaptive_bvh::QueryWork recorded = first_.recordedWork();
      work.box_tests = recorded.box_tests;
      work.bv_tests = recorded.separation_tests + recorded.bv_tests;
      work.leaf_tests = recorded.leaf_tests;
    } else {
      fcl::DistanceResultd result;
      work = countedDistance<Node, BV>(first_, second_, frame, result);
    }
    work.refitted = first_.lastUpdate().refitted() + second_.lastUpdate().refitted();
    return work;
  }

  std::size_t bytes() const override {
    return fclBytes(first_) + fclBytes(second_) + first_.trackingBytes() + second_.trackingBytes() +
           coherent_.bytes();
  }

 private:
  adaptive_bvh::AdaptiveBVHModel<BV> first_, second_;
  adaptive_bvh::CoherentDistance<BV> coherent_;
  Query query_;
};

using RssPair = AdaptivePair<fcl::RSSd, fcl::detail::MeshDistanceTraversalNodeRSSd>;
using ObbrssPair = AdaptivePair<fcl::OBBRSSd, fcl::detail::MeshDistanceTraversalNodeOBBRSSd>;

template <typename Pair = RssPair>
MethodKind row(std::string key, std::string title, const RefitPolicy& policy,
               Query query = Query::Recorded, MethodKind::Note note = MethodKind::Plain) {
  return {std::move(key), std::move(title), note, false,
          [policy, query](const scenarios::Scenario& scenario) {
            return std::make_unique<Pair>(scenario, policy, query);
          }};
}

}  // namespace

std::vector<MethodKind> adaptiveMethods() {
  const auto thesis = [](const char* key, FitnessCriterion criterion,
                         MethodKind::Note note = MethodKind::Plain) {
    return row(key, std::string("thesis: ") + toString(criterion), RefitPolicy::thesis(criterion),
               Query::Recorded, note);
  };
  RefitPolicy on_demand;
  on_demand.volumes_on_demand = true;
  return {
      row("coherent", "CoherentDistance", RefitPolicy(), Query::Coherent),
      row("recorded", "adaptive_bvh::distance", RefitPolicy()),
      row("drop-in", "drop-in, fcl::distance", RefitPolicy(), Query::DropIn),
      row("coherent-on-demand", "CoherentDistance, volumes on demand", on_demand, Query::Coherent),
      row("recorded-on-demand", "adaptive_bvh::distance, the same", on_demand),
      row<ObbrssPair>("coherent-obbrss", "OBBRSS: CoherentDistance", RefitPolicy(), Query::Coherent,
                      MethodKind::Slow),
      row<ObbrssPair>("recorded-obbrss", "OBBRSS: adaptive_bvh::distance", RefitPolicy(),
                      Query::Recorded, MethodKind::Slow),
      row<ObbrssPair>("drop-in-obbrss", "OBBRSS: drop-in, fcl::distance", RefitPolicy(),
                      Query::DropIn, MethodKind::Slow),
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
