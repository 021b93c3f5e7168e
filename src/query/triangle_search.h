#pragma once

#include <vector>

#include "query/placed_mesh.h"
#include "query/wide_search.h"

namespace adaptive_bvh {

/// What one thread does of a query for pairs of triangles: a walk over boxes, and the tests of what
/// it finds. `kIsSelf`: both meshes are the same, each pair is found once.
///
///   Tests                        a visitor of WideSearch, made of (input, frame, output)
///   Tests::Input                 the meshes, first and second, and their trees, tree1 and tree2
///   Tests::BoxFrame              how boxes of the second are compared with the first's, returned
///                                by Tests::boxFrame(input, frame)
///   tests.clear()                forgets the results of another query
///   tests.begin(), finish()      before and after a walk
template <bool kIsSelf, typename Tests>
class TriangleSearch {
 public:
  using Input = typename Tests::Input;

  /// `output` takes what is found.
  template <typename Frame, typename Output>
  TriangleSearch(const Input& input, const Frame& frame, Output& output)
      : input_(input),
        box_frame_(Tests::boxFrame(input, frame)),
        tests_(input, frame, output),
        walk_(input.tree1.nodes(), input.tree2.nodes(), box_frame_, tests_) {}
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

  long boxTests() const { return walk_.boxTests(); }

 private:
  const Input& input_;
  const typename Tests::BoxFrame box_frame_;
  Tests tests_;
  WideSearch<typename Tests::BoxFrame, kIsSelf, Tests> walk_;
};

}  // namespace adaptive_bvh
