#include "boxes/contours.h"

#include <algorithm>
#include <iterator>

namespace adaptive_bvh {
namespace {

/// A directed edge of a triangle. Edges between the same two vertices are adjacent in sorted order,
/// those from the smaller to the larger vertex first.
class Edge {
 public:
  /// `slot` is that of `from`. Vertex indices are below 2^31, because FCL counts in int.
  Edge(unsigned from, unsigned to, unsigned slot)
      : key_(from < to ? keyOf(from, to) : keyOf(to, from) | 1), slot_(slot) {}

  unsigned from() const { return isBack() ? larger() : smaller(); }
  unsigned to() const { return isBack() ? smaller() : larger(); }
  unsigned slot() const { return slot_; }
  bool isOppositeTo(const Edge& other) const { return (key_ ^ other.key_) == 1; }

  friend bool operator<(const Edge& a, const Edge& b) { return a.key_ < b.key_; }

 private:
  bool isBack() const { return key_ & 1; }
  static std::uint64_t keyOf(unsigned smaller, unsigned larger) {
    return std::uint64_t(smaller) << 32 | std::uint64_t(larger) << 1;
  }
  unsigned smaller() const { return static_cast<unsigned>(key_ >> 32); }
  unsigned larger() const { return static_cast<unsigned>(key_) >> 1; }

  std::uint64_t key_;
  unsigned slot_;
};
using Edges = std::vector<Edge>;

/// Removes pairs of opposite edges from sorted edges; returns the end of the remaining ones.
Edges::iterator cancelOpposites(Edges::iterator begin, Edges::iterator end) {
  auto kept = begin;
  for (auto edge = begin; edge != end; ++edge) {
    const bool goes_back = kept != begin && std::prev(kept)->isOppositeTo(*edge);
    if (goes_back)
      --kept;
    else
      *kept++ = *edge;
  }
  return kept;
}

/// Appends the slots of the vertices along the edges if the edges form one simple closed curve.
/// Returns the number of slots appended, else 0.
std::size_t addCurve(Edges edges, std::vector<unsigned>& slots) {
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.from() < b.from(); });
  const auto same_start = [](const Edge& a, const Edge& b) { return a.from() == b.from(); };
  if (edges.empty() || std::adjacent_find(edges.begin(), edges.end(), same_start) != edges.end())
    return 0;  // two edges begin at one vertex
  const std::size_t begin = slots.size();
  auto edge = edges.begin();
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && edge == edges.begin()) break;  // the curve closes before it has used all edges
    slots.push_back(edge->slot());
    edge = std::lower_bound(edges.begin(), edges.end(), edge->to(),
                            [](const Edge& e, unsigned vertex) { return e.from() < vertex; });
  }
  if (slots.size() - begin == edges.size()) return edges.size();
  slots.resize(begin);
  return 0;
}

/// Whether the flatness test is worth its cost. For fewer triangles than kFewest it takes as long
/// as searching them. The same holds for a contour much longer than that of a round patch, which is
/// about four times the square root of the number of triangles.
bool isWorthATest(std::size_t triangles, std::size_t contour) {
  constexpr std::size_t kFewest = 24;
  return triangles >= kFewest && contour * contour <= 256 * triangles;
}

/// Sets the patches of a tree's nodes and finds their contours. Add nodes from the last to the
/// first: children follow their parent, so their edges are then at the end of edges_.
class PatchFinder {
 public:
  PatchFinder(const WideNode* nodes, const VertexSlots& slots, Patch* patches)
      : nodes_(nodes), slots_(slots), patches_(patches) {}

  void add(int i) {
    const WideNode& node = nodes_[i];
    Patch& patch = patches_[i];
    if (node.isLeaf()) {
      patch = {static_cast<std::uint32_t>(node.first), static_cast<std::uint32_t>(node.count), 0,
               0};
      begins_.push_back(edges_.size());
      addEdges(node);
    } else {
      patch.first = patches_[node.below[0]].first;
      for (int k = 0; k < node.count; ++k) patch.count += patches_[node.below[k]].count;
      begins_.resize(begins_.size() - std::size_t(node.count) + 1);
    }
    const auto begin = edges_.begin() + static_cast<std::ptrdiff_t>(begins_.back());
    std::sort(begin, edges_.end());
    edges_.erase(cancelOpposites(begin, edges_.end()), edges_.end());
    const std::size_t length = edges_.size() - begins_.back();
    if (!isWorthATest(patch.count, length)) return;
    patch.contour = static_cast<std::uint32_t>(contours_.size());
    patch.length = static_cast<std::uint32_t>(addCurve({begin, edges_.end()}, contours_));
  }
  /// Patch::contour is an index into this vector.
  const std::vector<unsigned>& contours() const { return contours_; }

 private:
  void addEdges(const WideNode& leaf) {
    for (int i = 0; i < leaf.count; ++i) {
      const std::size_t triangle = static_cast<std::size_t>(leaf.first) + std::size_t(i);
      const VertexIndices slot = slots_.slotsOf(triangle), vertex = slots_.verticesOf(triangle);
      for (std::size_t k = 0; k < 3; ++k)
        if (vertex[k] != vertex[(k + 1) % 3])
          edges_.emplace_back(vertex[k], vertex[(k + 1) % 3], slot[k]);
    }
  }

  const WideNode* nodes_;
  const VertexSlots& slots_;
  Patch* patches_;
  Edges edges_;                      ///< contours of nodes whose parent has not been reached yet
  std::vector<std::size_t> begins_;  ///< beginnings of these contours in edges_
  std::vector<unsigned> contours_;
};

}  // namespace

void Contours::assign(const WideTree& tree) {
  patches_.assign(static_cast<std::size_t>(tree.size()), {0, 0, 0, 0});
  PatchFinder finder(tree.nodes(), tree.slots(), patches_.data());
  for (int i = tree.size(); i-- > 0;) finder.add(i);
  slots_ = finder.contours();  // a copy, to drop unused capacity
}

}  // namespace adaptive_bvh
