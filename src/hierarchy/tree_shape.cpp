#include "hierarchy/tree_shape.h"

#include <cmath>
#include <utility>

namespace adaptive_bvh {
namespace {

bool isPermutation(const Scratch<unsigned>& primitives) {
  std::vector<bool> is_taken(primitives.size(), false);
  for (const unsigned p : primitives) {
    if (p >= primitives.size() || is_taken[p]) return false;
    is_taken[p] = true;
  }
  return true;
}

/// Sets the links of all nodes, and the places of leaves.
bool linkNodes(const std::vector<bool>& shape, std::size_t leaves,
               Scratch<OrderedTree::Node>& nodes) {
  struct Open {
    int node, depth;
  };
  const int deepest = 2 * static_cast<int>(std::ceil(std::log2(double(leaves) + 1)));
  Scratch<Open> open;  // nodes whose right child is still to come
  unsigned places = 0;
  int depth = 0;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const int number = static_cast<int>(i);
    if (i > 0 && !shape[i - 1]) {
      nodes[i - 1].left = number;
      ++depth;
    } else if (i > 0) {
      if (open.empty()) return false;
      nodes[static_cast<std::size_t>(open.back().node)].right = number;
      depth = open.back().depth + 1;
      open.pop_back();
    }
    if (depth > deepest) return false;
    nodes[i] = {-1, -1, places, 1};
    if (shape[i])
      ++places;
    else
      open.push_back({number, depth});
  }
  return open.empty() && places == leaves;
}

}  // namespace

std::vector<bool> shapeOf(const OrderedTree& tree) {
  std::vector<bool> shape;
  shape.reserve(tree.nodes.size());
  for (const OrderedTree::Node& node : tree.nodes) shape.push_back(node.isLeaf());
  return shape;
}

bool treeOf(const std::vector<bool>& shape, Scratch<unsigned> primitives, OrderedTree& tree) {
  if (primitives.empty() || shape.size() != 2 * primitives.size() - 1) return false;
  if (!isPermutation(primitives)) return false;
  Scratch<OrderedTree::Node> nodes(shape.size());
  if (!linkNodes(shape, primitives.size(), nodes)) return false;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    OrderedTree::Node& node = nodes[i];
    if (node.isLeaf()) continue;
    node.count = nodes[static_cast<std::size_t>(node.left)].count +
                 nodes[static_cast<std::size_t>(node.right)].count;
  }
  tree.nodes = std::move(nodes);
  tree.primitives = std::move(primitives);
  return true;
}

}  // namespace adaptive_bvh
