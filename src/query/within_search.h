#pragma once

#include <vector>

#include "query/search_tasks.h"
#include "query/triangle_search.h"
#include "query/within_tests.h"

namespace adaptive_bvh {

/// Its output is a sink, which takes the near pairs.
template <bool kIsSelf, typename BV, typename Frame, typename Sink>
using WithinSearch = TriangleSearch<kIsSelf, BV, WithinTests<BV, Frame, Sink>>;

/// One thread's worker of a query for near pairs (SearchTasks), with a result of its own.
template <bool kIsSelf, typename BV, typename Frame, typename Sink>
class WithinWorker {
 public:
  using Search = WithinSearch<kIsSelf, BV, Frame, Sink>;
  using Mark = typename Sink::Mark;

  /// `sink`: of the query.
  WithinWorker(const WithinInput<BV>& input, const Frame& frame, const Sink& sink)
      : sink_(sink.another(own_)), search_(input, frame, sink_, memory_) {}

  Mark mark() const { return Sink::markOf(own_); }
  void run(const NodePairs& pairs, std::size_t) { search_.run(pairs); }

  const Sink& sink() const { return sink_; }
  const Search& search() const { return search_; }

 private:
  typename Search::Memory memory_;
  typename Sink::Result own_;
  Sink sink_;
  Search search_;
};

}  // namespace adaptive_bvh
