#include "boxes/feature_leaves.h"

namespace adaptive_bvh {
namespace {

/// Fills up the last group of four by repeating its last element.
template <typename T>
void pad(std::vector<T>& all) {
  while (all.size() % 4 != 0) all.push_back(T(all.back()));
}

}  // namespace

void FeatureLeaves::assign(const WideTree& tree, const FeatureOwners& owners) {
  const VertexSlots& slots = tree.slots();
  leaves_.clear();
  vertices_.clear();
  edges_.clear();
  for (int n = 0; n < tree.size(); ++n) {
    const WideNode& node = tree.nodes()[n];
    if (!node.isLeaf()) continue;
    const std::size_t vertices = vertices_.size(), edges = edges_.size();
    for (int i = 0; i < node.count; ++i) {
      const auto leaf_index = static_cast<unsigned>(node.first + i);
      const FeatureOwner& owner = owners[leaf_index];
      const VertexIndices slot = slots.slotsOf(leaf_index), v = slots.verticesOf(leaf_index);
      for (unsigned k = 0; k < 3; ++k) {
        const unsigned next = (k + 1) % 3;
        if (owner.ownsVertex(k)) vertices_.push_back({v[k], slot[k]});
        if (owner.ownsEdge(k))
          edges_.push_back({3 * owner.triangle + k, {v[k], v[next]}, {slot[k], slot[next]}});
      }
    }
    leaves_.push_back({static_cast<unsigned>(vertices / 4), static_cast<unsigned>(edges / 4),
                       static_cast<std::uint8_t>(vertices_.size() - vertices),
                       static_cast<std::uint8_t>(edges_.size() - edges)});
    pad(vertices_);
    pad(edges_);
  }
  leaves_.shrink_to_fit();
  vertices_.shrink_to_fit();
  edges_.shrink_to_fit();
}

}  // namespace adaptive_bvh
