// This library's proximity queries, and what FCL's users do instead: refit RSS top-down and collect
// pairs in FCL's distance traversal.
#include <algorithm>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "contact_judge.h"
#include "fcl_support.h"
#include "proximity_method.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh_bench {
namespace {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeaturePair;

ProximityAnswer sortedAnswer(std::vector<std::pair<unsigned, unsigned>> pairs) {
  std::sort(pairs.begin(), pairs.end());
  return {std::move(pairs), {}};
}

class MeshProximity : public ProximityMethod {
 public:
  MeshProximity(const ProximityCase& proximity_case, bool by_distance, int threads)
      : case_(proximity_case),
        by_distance_(by_distance),
        first_(case_.scenario.first.mesh()),
        second_(case_.scenario.second.mesh()) {
    for (DeformableMesh* mesh : {&first_, &second_}) {
      mesh->setThreads(threads);
      mesh->setThreads(threads);
    }
    request_.distance = case_.distance;
  }

  void update(const Frame& frame) override {
    first_.update(frame.first);
    if (!case_.is_self) second_.update(frame.second);
  }

  void ask() override {
    switch (case_.question) {
      case Question::Pairs:
        case_.is_self ? selfPairsWithin(first_, request_, pairs_)
                      : pairsWithin(first_, origin_, second_, origin_, request_, pairs_);
        break;
      case Question::Nearer: is_nearer_ = by_distance_ ? compareDistance() : compare(); break;
      case Question::Points: closestPoints(first_, case_.points, points_); break;
      case Question::Rays:
        firstHits(first_, case_.points.data(), case_.directions.data(), case_.points.size(), hits_);
        break;
      case Question::AnyRays:
        anyHits(first_, case_.points.data(), case_.directions.data(), case_.points.size(), any_);
        break;
    }
  }

  ProximityAnswer answer() const override {
    ProximityAnswer answer;
    for (const FeaturePair& p : pairs_.triangles) answer.pairs.emplace_back(p.first, p.second);
    answer = sortedAnswer(answer.pairs);
    for (const auto& p : points_) answer.numbers.push_back(p.distance);
    for (const auto& h : hits_) answer.numbers.push_back(h.t);
    answer.numbers.insert(answer.numbers.end(), any_.begin(), any_.end());
    if (case_.question == Question::Nearer) answer.numbers.push_back(is_nearer_);
    return answer;
  }

 private:
  bool compare() { return nearer_.isNearer(origin_, origin_, case_.distance); }
  bool compareDistance() {
    fcl::DistanceResultd result;
    return distance_.distance(origin_, origin_, fcl::DistanceRequestd(), result) <= case_.distance;
  }

  const ProximityCase& case_;
  const bool by_distance_;
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  DeformableMesh first_, second_;
  adaptive_bvh::CoherentProximity nearer_{first_, second_};
  adaptive_bvh::CoherentDistance distance_{first_, second_};
  adaptive_bvh::ProximityRequest request_;
  adaptive_bvh::TrianglePairs pairs_;
  std::vector<adaptive_bvh::ClosestPoint> points_;
  std::vector<adaptive_bvh::RayHit> hits_;
  std::vector<std::uint8_t> any_;
  bool is_nearer_ = false;
};

using Model = fcl::BVHModel<fcl::RSSd>;
using FclDistanceNode = fcl::detail::MeshDistanceTraversalNodeRSSd;

/// Goes below volumes that are within the distance, and keeps the pairs of triangles that are. Both
/// models are at the identity.
class CollectingNode : public FclDistanceNode {
 public:
  CollectingNode(double distance, bool is_self) : distance_(distance), is_self_(is_self) {}

  bool canStop(double bound) const override { return bound > distance_; }
  void leafTesting(int b1, int b2) const override {
    const auto a = unsigned(model1->getBV(b1).primitiveId()),
               b = unsigned(model2->getBV(b2).primitiveId());
    if (is_self_ && (a >= b || areNeighbours(tri_indices1[a], tri_indices2[b]))) return;
    const fcl::Triangle &s = tri_indices1[a], &t = tri_indices2[b];
    Point p, q;
    if (fcl::detail::TriangleDistanced::triDistance(
            vertices1[s[0]], vertices1[s[1]], vertices1[s[2]], vertices2[t[0]], vertices2[t[1]],
            vertices2[t[2]], p, q) <= distance_)
      pairs.emplace_back(a, b);
  }

  mutable std::vector<std::pair<unsigned, unsigned>> pairs;

 private:
  const double distance_;
  const bool is_self_;
};

class FclProximity : public ProximityMethod {
 public:
  explicit FclProximity(const ProximityCase& proximity_case) : case_(proximity_case) {
    fillModel(case_.scenario.first.mesh(), first_);
    if (!case_.is_self) fillModel(case_.scenario.second.mesh(), second_);
  }

  void update(const Frame& frame) override {
    refitTopDown(first_, frame.first);
    if (!case_.is_self) refitTopDown(second_, frame.second);
  }
  void ask() override {
    CollectingNode node(case_.distance, case_.is_self);
    fcl::DistanceResultd result;
    const fcl::Transform3d origin = fcl::Transform3d::Identity();
    fcl::detail::initialize(static_cast<FclDistanceNode&>(node), std::as_const(first_), origin,
                            std::as_const(case_.is_self ? first_ : second_), origin,
                            fcl::DistanceRequestd(), result);
    node.pairs.clear();  // FCL begins with a pair of its own choice
    fcl::detail::distance(&node);
    pairs_ = std::move(node.pairs);
  }
  ProximityAnswer answer() const override { return sortedAnswer(pairs_); }

 private:
  const ProximityCase& case_;
  Model first_, second_;
  std::vector<std::pair<unsigned, unsigned>> pairs_;
};

}  // namespace

std::vector<ProximityKind> adaptiveProximityMethods(int threads) {
  const auto make = [](bool by_distance, int used) {
    return [=](const ProximityCase& c) {
      return std::make_unique<MeshProximity>(c, by_distance, used);
    };
  };
  const std::vector<Question> all = {Question::Pairs, Question::Nearer, Question::Points,
                                     Question::Rays, Question::AnyRays};
  std::vector<ProximityKind> kinds = {{"adaptive_bvh", all, make(false, 1)},
                                      {"CoherentDistance", {Question::Nearer}, make(true, 1)}};
  if (threads > 1)
    kinds.push_back({"adaptive_bvh, " + std::to_string(threads) + " threads",
                     {Question::Pairs, Question::Points, Question::Rays, Question::AnyRays},
                     make(false, threads)});
  return kinds;
}

std::vector<ProximityKind> fclProximityMethods() {
  return {{"FCL RSS", {Question::Pairs}, [](const ProximityCase& c) {
             return std::make_unique<FclProximity>(c);
           }}};
}

}  // namespace adaptive_bvh_bench
