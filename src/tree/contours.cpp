#include "tree/contours.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

struct Edge {
  unsigned from, to;  ///< vertices
  unsigned slot;      ///< of `from`
};
using Iterator = std::vector<Edge>::iterator;

/// Takes away pairs of opposite edges; returns where the rest ends.
Iterator cancelOpposites(Iterator begin, Iterator end) {
  const auto ends = [](const Edge& e) { return std::minmax(e.from, e.to); };
  std::sort(begin, end, [&](const Edge& a, const Edge& b) {
    return std::make_pair(ends(a), a.from) < std::make_pair(ends(b), b.from);
  });
  Iterator kept = begin;
  for (Iterator same = begin; same != end;) {
    const auto both = ends(*same);
    const Iterator next = std::find_if(same, end, [&](const Edge& e) { return ends(e) != both; });
    const Iterator back =
        std::find_if(same, next, [&](const Edge& e) { return e.from != both.first; });
    const auto forward = back - same, backward = next - back;
    if (forward > backward)
      kept = std::copy(same + backward, back, kept);
    else
      kept = std::copy(back + forward, next, kept);
    same = next;
  }
  return kept;
}

/// Adds the slots along the edges when they are one closed curve that comes to no vertex twice.
/// Returns how many.
std::size_t addCurve(std::vector<Edge> edges, std::vector<unsigned>& slots) {
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.from < b.from; });
  const auto same_start = [](const Edge& a, const Edge& b) { return a.from == b.from; };
  if (edges.empty() || std::adjacent_find(edges.begin(), edges.end(), same_start) != edges.end())
    return 0;
  const std::size_t begin = slots.size();
  Iterator at = edges.begin();
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && at == edges.begin()) break;  // closed too early
    slots.push_back(at->slot);
    at = std::lower_bound(edges.begin(), edges.end(), at->to,
                          [](const Edge& e, unsigned vertex) { return e.from < vertex; });
  }
  if (slots.size() - begin == edges.size()) return edges.size();
  slots.resize(begin);
  return 0;
}

/// To test fewer triangles takes as long as to search them. So does a contour that is much longer
/// than that of a round patch, some four times the square root of the triangles.
bool isWorthATest(std::size_t triangles, std::size_t contour) {
  constexpr std::size_t kFewest = 24;
  return triangles >= kFewest && contour * contour <= 256 * triangles;
}

/// Adds the edges of the triangles of a leaf.
void addEdges(const WideNode& leaf, const VertexSlots& slots, std::vector<Edge>& edges) {
  for (int i = 0; i < leaf.count; ++i) {
    const std::size_t triangle = static_cast<std::size_t>(leaf.first) + std::size_t(i);
    const VertexIndices at = slots.slotsOf(triangle), vertex = slots.verticesOf(triangle);
    for (std::size_t k = 0; k < 3; ++k)
      if (vertex[k] != vertex[(k + 1) % 3])
        edges.push_back({vertex[k], vertex[(k + 1) % 3], at[k]});
  }
}

}  // namespace

/// From the last node to the first: those below a node follow it, so the edges of its children are
/// the last that were added when its turn comes.
void Contours::adopt(const WideNode* nodes, int count, const VertexSlots& slots) {
  patches_.assign(static_cast<std::size_t>(count), {0, 0, 0, 0});
  slots_.clear();
  std::vector<Edge> edges;
  std::vector<std::size_t> begins;  // of the edges of nodes whose parent is still to come
  for (std::size_t i = patches_.size(); i-- > 0;) {
    const WideNode& node = nodes[i];
    Patch& patch = patches_[i];
    if (node.isLeaf()) {
      patch = {static_cast<std::uint32_t>(node.first), static_cast<std::uint32_t>(node.count), 0,
               0};
      begins.push_back(edges.size());
      addEdges(node, slots, edges);
    } else {
      patch.first = patches_[static_cast<std::size_t>(node.below[0])].first;
      for (int k = 0; k < node.count; ++k)
        patch.count += patches_[static_cast<std::size_t>(node.below[k])].count;
      begins.resize(begins.size() - std::size_t(node.count) + 1);
    }
    const auto begin = edges.begin() + static_cast<std::ptrdiff_t>(begins.back());
    edges.erase(cancelOpposites(begin, edges.end()), edges.end());
    const std::size_t length = edges.size() - begins.back();
    if (!isWorthATest(patch.count, length)) continue;
    patch.contour = static_cast<std::uint32_t>(slots_.size());
    patch.length = static_cast<std::uint32_t>(addCurve({begin, edges.end()}, slots_));
  }
  slots_.shrink_to_fit();
}

}  // namespace adaptive_bvh
