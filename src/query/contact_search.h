#pragma once

#include <utility>
#include <vector>

#include "query/candidate_tests.h"
#include "query/fcl/mesh_collision_node.h"
#include "query/wide_search.h"

namespace adaptive_bvh {

/// FCL's test of two triangles, which adds their contacts.
template <typename BV>
struct ContactNode : MeshCollisionNode<BV> {
  void test(int triangle1, int triangle2) const {
    this->testTriangles(triangle1, triangle2, false);
  }
  void add(int triangle1, int triangle2) const { this->testTriangles(triangle1, triangle2, true); }
  bool isDone() const { return this->canStop(); }
};

/// What one thread does of a query for contacts: a walk, the tests of what it finds, and a record
/// of both. `kIsSelf`: both meshes are the same, each pair of triangles is to be tested once.
template <bool kIsSelf, typename BV, typename Frame>
class ContactSearch {
 public:
  /// Of VisitedNodes.
  using Memory = std::vector<std::uint8_t>[2];

  /// `node` takes the contacts; R and T of `input` are its own.
  ContactSearch(const CandidateInput<BV>& input, const Frame& frame, const ContactNode<BV>& node,
                Memory& memory)
      : input_(input),
        visited1_(memory[0], input.tree1.size()),
        visited2_(memory[1], kIsSelf ? 0 : input.tree2.size()),
        tests_(input, frame, node),
        walk_(input.tree1.nodes(), input.tree2.nodes(), frame, tests_, visited1_,
              kIsSelf ? visited1_ : visited2_) {}
  ContactSearch(const ContactSearch&) = delete;
  ContactSearch& operator=(const ContactSearch&) = delete;

  /// All contacts at or below a pair of nodes, until the node has enough.
  void run(const NodePair& from) {
    tests_.resume();
    walk_.run(from, input_.tree1.depth() + input_.tree2.depth());
    tests_.finish();
  }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
  }

  /// Takes over the record of another search of this query.
  void add(const ContactSearch& other) {
    visited1_.add(other.visited1_);
    visited2_.add(other.visited2_);
    box_tests_ += other.walk_.boxTests();
    candidates_ += other.tests_.candidates();
    leaf_tests_ += other.tests_.fclTests();
  }
  /// In both models.
  void record(const TaskPool& pool) const {
    visited1_.record(input_.tree1.nodes(), input_.first.visits(), pool);
    visited2_.record(input_.tree2.nodes(), input_.second.visits(), pool);
    QueryWork work;
    work.box_tests = walk_.boxTests() + box_tests_;
    work.candidates = tests_.candidates() + candidates_;
    work.leaf_tests = tests_.fclTests() + leaf_tests_;
    statisticsOf(input_.first, input_.second).recordQuery(work);
  }

 private:
  using Tests = CandidateTests<BV, Frame, const ContactNode<BV>>;

  const CandidateInput<BV> input_;
  VisitedNodes visited1_, visited2_;
  Tests tests_;
  WideSearch<Frame, kIsSelf, Tests> walk_;
  long box_tests_ = 0, candidates_ = 0, leaf_tests_ = 0;  ///< of other searches
};

}  // namespace adaptive_bvh
