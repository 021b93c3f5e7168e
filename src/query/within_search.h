#pragma once

#include <vector>

#include "query/search_tasks.h"
#include "query/triangle_search.h"
#include "query/within_tests.h"

namespace adaptive_bvh {

/// Its output is a sink, which takes the near pairs.
template <bool kIsSelf, typename S, typename Frame, typename Sink>
using WithinSearch = TriangleSearch<kIsSelf, WithinTests<S, Frame, Sink>>;

/// One thread's worker of a query for near pairs (SearchTasks), with a result of its own.
template <bool kIsSelf, typename S, typename Frame, typename Sink>
class WithinWorker {
 public:
  using Search = WithinSearch<kIsSelf, S, Frame, Sink>;
  using Mark = typename Sink::Mark;
  using Memory = typename Sink::Result;  ///< that is kept from query to query

  /// `sink`: of the query.
  WithinWorker(const WithinInput<S>& input, const Frame& frame, const Sink& sink, Memory& memory)
      : sink_(sink.another(memory)), search_(input, frame, sink_) {
    memory.clear();
  }

  Mark mark() const { return sink_.mark(); }
  void run(const NodePairs& pairs, std::size_t) { search_.run(pairs); }

  const Sink& sink() const { return sink_; }
  const Search& search() const { return search_; }

 private:
  Sink sink_;
  Search search_;
};

}  // namespace adaptive_bvh
