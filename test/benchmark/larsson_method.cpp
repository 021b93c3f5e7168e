// Larsson and Akenine-Moeller, "A dynamic bounding volume hierarchy for generalized collision
// detection" (2006), on rectangle-swept spheres. No error propagation: a volume is valid in a frame
// only if it was refitted in it. Before a query, the volumes that the last one tested ("active")
// are refitted, deepest first; where the query comes to another one, it is refitted on demand. The
// thesis could only model this, as its criterion B.
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/hierarchy.h"
#include "fcl_support.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh_bench {
namespace {

using Plain = fcl::BVHModel<fcl::RSSd>;

class LazyTree {
 public:
  explicit LazyTree(const scenarios::Body& body) : model_(built(body)) {
    for (int triangle : adaptive_bvh::primitivesBelow(model_, 0))
      order_.push_back(unsigned(triangle));
    valid_in_.assign(std::size_t(model_.getNumBVs()), 0);
    tested_in_ = valid_in_;
    view_.vertices = model_.vertices;
    view_.triangles = model_.tri_indices;
  }
  LazyTree(const LazyTree&) = delete;
  LazyTree& operator=(const LazyTree&) = delete;

  void update(const Positions& positions) {
    std::copy(positions.begin(), positions.end(), model_.vertices);
    ++frame_;
    refitted_ = 0;
    std::sort(active_.begin(), active_.end(), std::greater<int>());  // children behind parents
    for (int node : active_) refit(node);
    if (!valid(0)) refit(0);
    active_.clear();
  }

  /// The query comes to a node.
  void visit(int node) {
    if (!valid(node)) refit(node);
    if (tested_in_[std::size_t(node)] == frame_) return;
    tested_in_[std::size_t(node)] = frame_;
    active_.push_back(node);
  }

  const Plain& model() const { return model_; }
  int refitted() const { return refitted_; }
  std::size_t bytes() const {
    return fclBytes(model_) + (order_.size() + 2 * valid_in_.size() + active_.size()) * sizeof(int);
  }

 private:
  /// The same tree as this library's models have.
  static Plain built(const scenarios::Body& body) {
    adaptive_bvh::AdaptiveBVHModeld model;
    fillModel(body.mesh(), model);
    return Plain(model);
  }

  bool valid(int node) const { return valid_in_[std::size_t(node)] == frame_; }

  void refit(int i) {
    fcl::BVNode<fcl::RSSd>& node = model_.getBV(i);
    node.bv = adaptive_bvh::Volume<fcl::RSSd>::fit(
        view_, &order_[std::size_t(node.first_primitive)], node.num_primitives);
    valid_in_[std::size_t(i)] = frame_;
    ++refitted_;
  }

  Plain model_;
  adaptive_bvh::MeshView<double> view_;
  std::vector<unsigned> order_;
  int frame_ = 0;
  std::vector<int> valid_in_;   // by node: the last frame it was refitted in
  std::vector<int> tested_in_;  // and tested
  std::vector<int> active_;
  int refitted_ = 0;
};

class LazyNode : public fcl::detail::MeshDistanceTraversalNodeRSSd {
 public:
  LazyNode(LazyTree& first, LazyTree& second) : first_(first), second_(second) {}

  double BVTesting(int b1, int b2) const override {
    first_.visit(b1);
    second_.visit(b2);
    return fcl::detail::MeshDistanceTraversalNodeRSSd::BVTesting(b1, b2);
  }

 private:
  LazyTree &first_, &second_;
};

class LazyPair : public Method {
 public:
  explicit LazyPair(const scenarios::Scenario& scenario)
      : first_(scenario.first), second_(scenario.second) {}

  void update(const Frame& frame) override {
    first_.update(frame.first);
    second_.update(frame.second);
  }

  double distance(const Frame& frame) override {
    LazyNode node(first_, second_);
    fcl::DistanceResultd result;
    fcl::detail::initialize(static_cast<fcl::detail::MeshDistanceTraversalNodeRSSd&>(node),
                            first_.model(), frame.tf1, second_.model(), frame.tf2,
                            fcl::DistanceRequestd(), result);
    node.enableStatistics(true);
    fcl::detail::distance(&node);
    work_ = {node.num_bv_tests, node.num_leaf_tests, 0};
    return result.min_distance;
  }

  Work work(const Frame&) override {
    work_.refitted = first_.refitted() + second_.refitted();
    return work_;
  }

  std::size_t bytes() const override { return first_.bytes() + second_.bytes(); }

 private:
  LazyTree first_, second_;
  Work work_;
};

}  // namespace

std::vector<MethodKind> larssonMethods() {
  return {
      {"larsson", "Larsson 2006: active nodes, on demand", MethodKind::Plain, false,
       [](const scenarios::Scenario& scenario) { return std::make_unique<LazyPair>(scenario); }}};
}

}  // namespace adaptive_bvh_bench
