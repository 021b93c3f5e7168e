#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "mesh/feature_owners.h"

namespace adaptive_bvh {

/// The boundary of a surface as closed curves. It consists of the edges that triangles traverse
/// more often in one direction than in the other. Each boundary edge has that direction, and occurs
/// as many times as the two counts differ. At each vertex as many boundary edges begin as end, so
/// they form closed curves. A closed mesh has none; separate triangles contribute all their edges.
class BoundaryLoops {
 public:
  /// The edges may be in any order.
  void assign(const std::vector<BoundaryEdge>& boundary) {
    std::vector<Edge> edges;
    edges.reserve(boundary.size());
    for (const BoundaryEdge& e : boundary)
      edges.insert(edges.end(), static_cast<std::size_t>(e.surplus), {e.from, e.to});
    trace(std::move(edges));
  }

  bool isEmpty() const { return vertices_.empty(); }
  /// The vertices of all curves, one curve after the other. In each, the last vertex connects to
  /// the first.
  const std::vector<unsigned>& vertices() const { return vertices_; }
  /// The number of curves.
  std::size_t size() const { return ends_.size(); }
  /// The index in vertices() at which a curve ends and the next one begins.
  std::size_t end(std::size_t curve) const { return ends_[curve]; }
  std::size_t bytes() const {
    return vertices_.capacity() * sizeof(unsigned) + ends_.capacity() * sizeof(std::size_t);
  }

 private:
  struct Edge {
    unsigned from, to;

    friend bool operator<(const Edge& a, const Edge& b) { return a.from < b.from; }
  };

  /// Follows unused edges from a vertex until it reaches a vertex where no unused edge begins. That
  /// is the curve's first vertex, because as many edges begin as end at each vertex. Repeats this
  /// until all edges are used.
  void trace(std::vector<Edge> edges) {
    if (!std::is_sorted(edges.begin(), edges.end())) std::stable_sort(edges.begin(), edges.end());
    // The edges that begin at one vertex are contiguous. If edge i is the first of them, next[i] is
    // the next unused one; if none is left, the first edge of the next vertex.
    std::vector<std::size_t> next(edges.size());
    std::iota(next.begin(), next.end(), std::size_t(0));
    vertices_.reserve(edges.size());
    const auto hasUnused = [&](std::size_t i) {
      return next[i] < edges.size() && edges[next[i]].from == edges[i].from;
    };
    for (std::size_t first = 0; first < edges.size(); first = next[first])
      while (hasUnused(first)) {
        for (std::size_t i = first; hasUnused(i);) {
          vertices_.push_back(edges[i].from);
          const Edge at_end{edges[next[i]++].to, 0};
          i = static_cast<std::size_t>(std::lower_bound(edges.begin(), edges.end(), at_end) -
                                       edges.begin());
        }
        ends_.push_back(vertices_.size());
      }
    ends_.shrink_to_fit();
  }

  std::vector<unsigned> vertices_;
  std::vector<std::size_t> ends_;
};

}  // namespace adaptive_bvh
