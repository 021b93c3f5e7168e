#pragma once

#include <vector>

#include "boxes/wide_search.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// A vertex that may be a contact.
struct VertexCandidate {
  unsigned vertex;
  bool is_inside;  ///< whether that is known: it is inside, and far from the surface
};

/// The vertices of one mesh that may be near another's surface, or inside of it. Goes down the tree
/// of the first with a list of those nodes of the other whose boxes overlap, both a level at a
/// time. A box with an empty list is clear of the other's surface. So all vertices in that box are
/// on one side, and one test of one of them decides for all. Each vertex is visited once, with the
/// triangle that owns it.
template <typename S, typename IsInside>
class VertexSearch {
 public:
  /// `tree`: of `mesh`, perhaps in other coordinates. `frame`: takes boxes of `other` to those and
  /// lets them grow by the margin. `is_inside(v)`: whether a vertex of `mesh` is inside.
  VertexSearch(const MeshState<S>& mesh, const WideTree& tree, const WideTree& other,
               const BoxFrame& frame, IsInside is_inside, std::vector<VertexCandidate>& candidates)
      : mesh_(mesh),
        tree_(tree),
        other_(other),
        frame_(frame),
        is_inside_(is_inside),
        candidates_(candidates) {}

  void run() {
    open_.clear();
    open_.push_back({0, 0});
    visit(tree_.nodes()[0], 0);
    open_.clear();
  }

 private:
  /// A node of the other tree, and which of its boxes overlap those of the node that is visited.
  struct Other {
    int node;
    unsigned overlaps;
  };

  /// The list of the node is that from `first` on.
  void visit(const WideNode& node, std::size_t first) {
    unsigned any = 0;
    const std::size_t last = open_.size();
    for (std::size_t i = first; i < last; ++i) {
      open_[i].overlaps = overlaps(node.boxes, frame_(other_.nodes()[open_[i].node].boxes));
      any |= open_[i].overlaps;
    }
    any |= any >> 8;
    any |= any >> 4;  // bit i: whether box i overlaps any
    if (node.isLeaf()) return addLeaf(node);
    for (unsigned i = 0; i < node.count; ++i) {
      const int below = node.below[i];
      if (!(any >> i & 1)) {
        addClear(below);
        continue;
      }
      for (std::size_t k = first; k < last; ++k) openBelow(open_[k], i);
      visit(tree_.nodes()[below], last);
      open_.resize(last);
    }
  }
  /// Adds those nodes below one that overlap box i; a leaf itself.
  void openBelow(const Other other, unsigned i) {
    const WideNode& node = other_.nodes()[other.node];
    const unsigned lanes = other.overlaps >> i & 0x1111;
    if (node.isLeaf() && lanes) open_.push_back({other.node, 0});
    for (unsigned j = 0; !node.isLeaf() && j < node.count; ++j)
      if (lanes >> 4 * j & 1) open_.push_back({node.below[j], 0});
  }

  void addLeaf(const WideNode& leaf) {
    const auto first = static_cast<std::size_t>(leaf.first);
    addOwned(first, first + leaf.count, false);
  }
  void addClear(int node) {
    const std::size_t first = firstPlace(node), last = lastPlace(node) + 1;
    const bool is_inside =
        is_inside_(static_cast<unsigned>(tree_.corners(static_cast<unsigned>(first))[0]));
    if (is_inside) addOwned(first, last, true);
  }
  void addOwned(std::size_t first, std::size_t last, bool is_inside) {
    for (std::size_t place = first; place < last; ++place)
      for (unsigned k = 0; k < 3; ++k)
        if (mesh_.topology->owners[place].ownsVertex(k))
          candidates_.push_back(
              {static_cast<unsigned>(tree_.corners(static_cast<unsigned>(place))[int(k)]),
               is_inside});
  }

  /// The places below a node lie together.
  std::size_t firstPlace(int node) const {
    const WideNode* at = &tree_.nodes()[node];
    while (!at->isLeaf()) at = &tree_.nodes()[at->below[0]];
    return static_cast<std::size_t>(at->first);
  }
  std::size_t lastPlace(int node) const {
    const WideNode* at = &tree_.nodes()[node];
    while (!at->isLeaf()) at = &tree_.nodes()[at->below[at->count - 1]];
    return static_cast<std::size_t>(at->first) + at->count - 1;
  }

  const MeshState<S>& mesh_;
  const WideTree &tree_, &other_;
  const BoxFrame& frame_;
  IsInside is_inside_;
  std::vector<VertexCandidate>& candidates_;
  static inline thread_local std::vector<Other> open_;  ///< the lists, one after the other
};

}  // namespace adaptive_bvh
