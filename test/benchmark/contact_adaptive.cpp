// DeformableMesh with selfCollide, collide, distance and CoherentDistance.
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "contact_pairs.h"

namespace adaptive_bvh_bench {
namespace {

class MeshContact : public ContactMethod {
 public:
  MeshContact(const ContactCase& contact_case, bool coherently, int threads)
      : job_(contact_case.job),
        coherently_(coherently),
        first_(contact_case.scenario.first.mesh()),
        second_(contact_case.scenario.second.mesh()) {
    first_.setThreads(threads);
    second_.setThreads(threads);
    first_.setThreads(threads);
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
        adaptive_bvh::collide(&first_, origin_, &second_, origin_, allContacts(), contacts_);
        break;
      case Job::Distance: distance(); break;
      case Job::Continuous: break;  // contact_continuous.cpp
    }
  }

  ContactAnswer answer() override {
    ContactAnswer answer;
    answer.distance = distance_;
    answer.pairs = pairsOf(contacts_, job_ == Job::SelfCollision);
    return answer;
  }

 private:
  void distance() {
    fcl::DistanceResultd result;
    const fcl::DistanceRequestd request;
    distance_ = coherently_
                    ? coherent_.distance(origin_, origin_, request, result)
                    : adaptive_bvh::distance(&first_, origin_, &second_, origin_, request, result);
  }

  Job job_;
  bool coherently_;
  adaptive_bvh::DeformableMesh first_, second_;
  adaptive_bvh::CoherentDistance coherent_{first_, second_};
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  fcl::CollisionResultd contacts_;
  double distance_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace

std::vector<ContactKind> adaptiveContactMethods(int threads) {
  const auto make = [](bool coherently, int used = 1) {
    return [coherently, used](const ContactCase& c) {
      return std::make_unique<MeshContact>(c, coherently, used);
    };
  };
  const std::vector<Job> contacts = {Job::SelfCollision, Job::Collide};
  const std::vector<Job> all = {Job::SelfCollision, Job::Collide, Job::Distance};
  std::vector<ContactKind> kinds = {
      {kContactOurs, "adaptive_bvh", ContactKind::Ours, true, all, make(false)},
      {"coherent", "CoherentDistance", ContactKind::Ours, true, {Job::Distance}, make(true)}};
  if (threads > 1)
    kinds.push_back({"threads", "adaptive_bvh, " + std::to_string(threads) + " threads",
                     ContactKind::Ours, true, contacts, make(false, threads)});
  return kinds;
}

}  // namespace adaptive_bvh_bench
