#include "hierarchy/ordered_tree.h"

namespace adaptive_bvh {

OrderedTree::OrderedTree(const BinaryTree& tree) {
  struct Open {
    unsigned of_binary;
    int parent;
    bool is_right;
  };
  const std::size_t size = tree.leaves + tree.children.size();
  Scratch<unsigned> counts(size, 1);
  for (std::size_t i = 0; i < tree.children.size(); ++i)
    counts[tree.leaves + i] = counts[tree.children[i][0]] + counts[tree.children[i][1]];
  nodes.reserve(size);
  primitives.reserve(tree.leaves);
  Scratch<Open> open(1, Open{static_cast<unsigned>(size) - 1, -1, false});
  while (!open.empty()) {
    const Open at = open.back();
    open.pop_back();
    const auto number = static_cast<int>(nodes.size());
    if (at.parent >= 0) {
      Node& parent = nodes[static_cast<std::size_t>(at.parent)];
      (at.is_right ? parent.right : parent.left) = number;
    }
    nodes.push_back({-1, -1, static_cast<unsigned>(primitives.size()), counts[at.of_binary]});
    if (at.of_binary < tree.leaves) {
      primitives.push_back(at.of_binary);
      continue;
    }
    const std::array<unsigned, 2>& below = tree.children[at.of_binary - tree.leaves];
    open.push_back({below[1], number, true});
    open.push_back({below[0], number, false});
  }
}

}  // namespace adaptive_bvh
