#pragma once

#include <vector>

#include "query/placed_mesh.h"
#include "query/wide_search.h"

namespace adaptive_bvh {

/// What one thread does of a query for pairs of triangles: a walk over boxes, and the tests of what
/// it finds. Where both meshes of the input are one object, each pair is found once.
///
///   Tests                        made of (input, frame, output)
///   Tests::Input                 the meshes, first and second, and their trees, tree1 and tree2
///   Tests::boxFrame(input, frame)  how boxes of the second are compared with the first's
///   Tests::flat(input)           nodes to leave out, or null
///   tests.clear()                forgets the results of another query
///   tests.begin(), finish()      before and after a walk
///   tests.foundLeaves(a, b, pairs)  two leaves, or one twice, as LeavesFound
///   tests.isDone()               whether the answer is found
template <typename Tests>
class TriangleSearch final : private LeafSink {
 public:
  using Input = typename Tests::Input;

  /// `output` takes what is found.
  template <typename Frame, typename Output>
  TriangleSearch(const Input& input, const Frame& frame, Output& output)
      : tests_(input, frame, output),
        walk_({input.tree1.nodes(), input.tree2.nodes(), input.tree1.depth() + input.tree2.depth(),
               Tests::boxFrame(input, frame), &input.first == &input.second, Tests::flat(input)}) {}
  TriangleSearch(const TriangleSearch&) = delete;
  TriangleSearch& operator=(const TriangleSearch&) = delete;

  /// Forgets the results of another query.
  void clear() { tests_.clear(); }
  /// All pairs at or below some pairs of nodes, until there are enough.
  void run(const NodePairs& from) {
    tests_.begin();
    if (!tests_.isDone()) walk_.run(from, *this);
    tests_.finish();
  }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
  }

 private:
  bool take(const LeavesFound* found, int count) override {
    for (int i = 0; i < count; ++i)
      tests_.foundLeaves(*found[i].first, *found[i].second, found[i].pairs);
    return tests_.isDone();
  }

  Tests tests_;
  WideSearch walk_;
};

}  // namespace adaptive_bvh
