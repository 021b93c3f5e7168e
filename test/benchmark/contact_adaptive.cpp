// This library's update with selfCollide, collide, distance and CoherentDistance.
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "contact_pairs.h"

namespace adaptive_bvh_bench {
namespace {

enum class Way { Default, OnDemand, Coherent };

adaptive_bvh::RefitPolicy policyOf(Way way) {
  adaptive_bvh::RefitPolicy policy;
  policy.volumes_on_demand = way == Way::OnDemand;
  return policy;
}

class AdaptiveContact : public ContactMethod {
 public:
  AdaptiveContact(const ContactCase& contact_case, Way way, int threads)
      : job_(contact_case.job), way_(way), first_(policyOf(way)), second_(policyOf(way)) {
    fillModel(contact_case.scenario.first.mesh(), first_);
    first_.setUpdateThreads(threads);
    second_.setUpdateThreads(threads);
    first_.setQueryThreads(threads);
    if (job_ != Job::SelfCollision) fillModel(contact_case.scenario.second.mesh(), second_);
  }

  void update(const Frame& frame) override {
    first_.update(frame.first);
    if (job_ != Job::SelfCollision) second_.update(frame.second);
  }

  void query() override {
    contacts_.clear();
    switch (job_) {
      case Job::SelfCollision: selfCollide(first_, allContacts(), contacts_); break;
      case Job::Collide:
        adaptive_bvh::collide<double>(&first_, origin_, &second_, origin_, allContacts(),
                                      contacts_);
        break;
      case Job::Distance: distance(); break;
      case Job::Continuous: break;  // contact_continuous.cpp
    }
  }

  ContactAnswer answer() override {
    const adaptive_bvh::QueryWork work = first_.recordedWork();
    ContactAnswer answer;
    answer.counts = {work.box_tests + work.separation_tests + work.bv_tests,
                     job_ == Job::Distance ? -1 : work.candidates, work.leaf_tests, -1};
    answer.distance = distance_;
    answer.pairs = pairsOf(contacts_, job_ == Job::SelfCollision);
    return answer;
  }

 private:
  void distance() {
    fcl::DistanceResultd result;
    const fcl::DistanceRequestd request;
    distance_ = way_ == Way::Coherent ? coherent_.distance(origin_, origin_, request, result)
                                      : adaptive_bvh::distance<double>(&first_, origin_, &second_,
                                                                       origin_, request, result);
  }

  Job job_;
  Way way_;
  adaptive_bvh::AdaptiveBVHModeld first_, second_;
  adaptive_bvh::CoherentDistanced coherent_{first_, second_};
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  fcl::CollisionResultd contacts_;
  double distance_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace

std::vector<ContactKind> adaptiveContactMethods(int threads) {
  const auto make = [](Way way, int used = 1) {
    return [way, used](const ContactCase& c) {
      return std::make_unique<AdaptiveContact>(c, way, used);
    };
  };
  const std::vector<Job> contacts = {Job::SelfCollision, Job::Collide};
  const std::vector<Job> all = {Job::SelfCollision, Job::Collide, Job::Distance};
  std::vector<ContactKind> kinds = {
      {kContactOurs, "adaptive_bvh", ContactKind::Ours, true, all, make(Way::Default)},
      {"on-demand", "adaptive_bvh, volumes on demand", ContactKind::Ours, true, all,
       make(Way::OnDemand)},
      {"coherent",
       "CoherentDistance",
       ContactKind::Ours,
       true,
       {Job::Distance},
       make(Way::Coherent)}};
  if (threads > 1)
    kinds.push_back({"threads", "adaptive_bvh, " + std::to_string(threads) + " threads",
                     ContactKind::Ours, true, contacts, make(Way::Default, threads)});
  return kinds;
}

}  // namespace adaptive_bvh_bench
