// FCL as it is meant for deforming meshes: swept spheres, refitted top-down (the sound way), and
// its own traversals, without the copies that fcl::collide makes of meshes with such volumes.
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>

#include "contact_judge.h"
#include "contact_pairs.h"
#include "fcl_support.h"

namespace adaptive_bvh_bench {
namespace {

using Model = fcl::BVHModel<fcl::RSSd>;
using FclCollisionNode = fcl::detail::MeshCollisionTraversalNodeRSSd;

/// Counts what it hands to FCL's test; of one mesh it leaves neighbours out.
class CountingNode : public FclCollisionNode {
 public:
  explicit CountingNode(bool is_self) : is_self_(is_self) {}

  void leafTesting(int b1, int b2) const override {
    if (is_self_ && areNeighbours(tri_indices1[model1->getBV(b1).primitiveId()],
                                  tri_indices1[model1->getBV(b2).primitiveId()]))
      return;
    ++triangle_tests;
    FclCollisionNode::leafTesting(b1, b2);
  }

  mutable long triangle_tests = 0;

 private:
  bool is_self_;
};

class FclContact : public ContactMethod {
 public:
  explicit FclContact(const ContactCase& contact_case) : job_(contact_case.job) {
    fillModel(contact_case.scenario.first.mesh(), first_);
    if (job_ != Job::SelfCollision) fillModel(contact_case.scenario.second.mesh(), second_);
  }

  void update(const Frame& frame) override {
    refitTopDown(first_, frame.first);
    if (job_ != Job::SelfCollision) refitTopDown(second_, frame.second);
  }

  void query() override {
    if (job_ == Job::Distance)
      distance();
    else
      collide(job_ == Job::SelfCollision ? first_ : second_);
  }

  ContactAnswer answer() override {
    ContactAnswer answer;
    answer.counts = counts_;
    answer.distance = distance_;
    answer.pairs = pairsOf(contacts_, job_ == Job::SelfCollision);
    return answer;
  }

 private:
  void collide(const Model& other) {
    const fcl::Transform3d origin = fcl::Transform3d::Identity();
    const fcl::CollisionRequestd request = allContacts();
    contacts_.clear();
    CountingNode node(job_ == Job::SelfCollision);
    fcl::detail::initialize(static_cast<FclCollisionNode&>(node), first_, origin, other, origin,
                            request, contacts_);
    node.enableStatistics(true);
    auto* base = static_cast<fcl::detail::CollisionTraversalNodeBased*>(&node);
    job_ == Job::SelfCollision ? fcl::detail::selfCollide(base) : fcl::detail::collide(base);
    counts_ = {node.num_bv_tests, -1, node.triangle_tests, -1};
  }

  void distance() {
    fcl::DistanceResultd result;
    const Work work = countedDistance<fcl::detail::MeshDistanceTraversalNodeRSSd>(first_, second_,
                                                                                  Frame(), result);
    distance_ = result.min_distance;
    counts_ = {work.bv_tests, -1, work.leaf_tests, -1};
  }

  Job job_;
  Model first_, second_;
  fcl::CollisionResultd contacts_;
  double distance_ = std::numeric_limits<double>::quiet_NaN();
  ContactCounts counts_;
};

}  // namespace

std::vector<ContactKind> fclContactMethods() {
  return {{kContactReference,
           "FCL RSS",
           ContactKind::Peer,
           true,
           {Job::SelfCollision, Job::Collide, Job::Distance},
           [](const ContactCase& c) { return std::make_unique<FclContact>(c); }}};
}

}  // namespace adaptive_bvh_bench
