#include "deformable/moved_leaves.h"

namespace adaptive_bvh {
namespace {

/// Calls visit(vertex, node) once for every leaf node and every vertex of its triangles.
template <typename Visit>
void forEachVertexOfLeaves(const WideTree& tree, const Visit& visit) {
  for (int n = 0; n < tree.size(); ++n) {
    const WideNode& node = tree.nodes()[n];
    if (!node.isLeaf()) continue;
    std::uint32_t visited[12];  // four triangles have at most twelve vertices
    int count = 0;
    for (int i = 0; i < node.count; ++i)
      for (int k = 0; k < 3; ++k) {
        const auto vertex = static_cast<std::uint32_t>(tree.corners(unsigned(node.first + i))[k]);
        bool is_new = true;
        for (int j = 0; j < count; ++j) is_new = is_new && visited[j] != vertex;
        if (!is_new) continue;
        visited[count++] = vertex;
        visit(vertex, static_cast<unsigned>(n));
      }
  }
}

}  // namespace

MovedLeaves::MovedLeaves(const WideTree& tree, std::size_t num_vertices)
    : begins_(num_vertices + 2, 0),  // shifted by one while they are filled
      parents_(static_cast<std::size_t>(tree.size()), 0),
      marked_((static_cast<std::size_t>(tree.size()) + 63) / 64, 0) {
  named_.reserve(num_vertices);
  forEachVertexOfLeaves(tree, [&](unsigned vertex, unsigned) { ++begins_[vertex + 2]; });
  for (std::size_t i = 2; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  leaves_.resize(begins_.back());
  forEachVertexOfLeaves(
      tree, [&](unsigned vertex, unsigned node) { leaves_[begins_[vertex + 1]++] = node; });
  begins_.pop_back();
  for (int n = 0; n < tree.size(); ++n) {
    const WideNode& node = tree.nodes()[n];
    for (int i = 0; i < node.count && !node.isLeaf(); ++i)
      parents_[static_cast<std::size_t>(node.below[i])] = static_cast<unsigned>(n);
  }
}

}  // namespace adaptive_bvh
