#pragma once

#include <cstdint>
#include <vector>

#include "query/placed_mesh.h"
#include "query/wide_search.h"

namespace adaptive_bvh {

/// What one thread does of a query for pairs of triangles: a walk over boxes, the tests of what it
/// finds, and a record of both. `kIsSelf`: both meshes are the same, each pair is found once.
///
///   Tests                        a visitor of WideSearch, made of (input, frame, output)
///   Tests::Input                 the meshes, first and second, and their trees, tree1 and tree2
///   Tests::BoxFrame              how boxes of the second are compared with the first's, returned
///                                by Tests::boxFrame(input, frame)
///   tests.clear()                forgets the results of another query
///   tests.begin(), finish()      before and after a walk
///   tests.candidates(), leafTests()   for the record
template <bool kIsSelf, typename BV, typename Tests>
class TriangleSearch {
 public:
  using Input = typename Tests::Input;
  using Memory = VisitedNodes::Memory[2];

  /// `output` takes what is found.
  template <typename Frame, typename Output>
  TriangleSearch(const Input& input, const Frame& frame, Output& output, Memory& memory)
      : input_(input),
        box_frame_(Tests::boxFrame(input, frame)),
        visited1_(memory[0], input.tree1.size(), input.first.visits()),
        visited2_(memory[1], kIsSelf ? 0 : input.tree2.size(), input.second.visits()),
        tests_(input, frame, output),
        walk_(input.tree1.nodes(), input.tree2.nodes(), box_frame_, tests_, visited1_,
              kIsSelf ? visited1_ : visited2_) {}
  TriangleSearch(const TriangleSearch&) = delete;
  TriangleSearch& operator=(const TriangleSearch&) = delete;

  /// Forgets the results of another query.
  void clear() { tests_.clear(); }
  /// All pairs at or below some pairs of nodes, until there are enough.
  void run(const NodePairs& from) {
    tests_.begin();
    walk_.run(from, input_.tree1.depth() + input_.tree2.depth());
    tests_.finish();
  }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
  }

  long boxTests() const { return walk_.boxTests() + box_tests_; }

  /// Takes over the record of another search of this query.
  void add(const TriangleSearch& other) {
    visited1_.add(other.visited1_);
    visited2_.add(other.visited2_);
    box_tests_ += other.walk_.boxTests();
    candidates_ += other.tests_.candidates();
    leaf_tests_ += other.tests_.leafTests();
  }
  /// In both models.
  void record(const TaskPool& pool) const {
    visited1_.record(input_.tree1.nodes(), pool);
    visited2_.record(input_.tree2.nodes(), pool);
    QueryWork work;
    work.box_tests = boxTests();
    work.candidates = tests_.candidates() + candidates_;
    work.leaf_tests = tests_.leafTests() + leaf_tests_;
    statisticsOf(input_.first, input_.second).recordQuery(work);
  }

 private:
  const Input& input_;
  const typename Tests::BoxFrame box_frame_;
  VisitedNodes visited1_, visited2_;
  Tests tests_;
  WideSearch<typename Tests::BoxFrame, kIsSelf, Tests> walk_;
  long box_tests_ = 0, candidates_ = 0, leaf_tests_ = 0;  ///< of other searches
};

}  // namespace adaptive_bvh
