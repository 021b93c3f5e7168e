#include "hierarchy/bottom_up.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "hierarchy/links.h"
#include "hierarchy/pairing.h"

namespace adaptive_bvh {
namespace {

/// For each group its connected component, named by the smallest number of a group in it.
Scratch<unsigned> components(const GroupGraph& graph) {
  Scratch<unsigned> component(graph.size(), kNone), queue;
  for (unsigned g = 0; g < graph.size(); ++g) {
    if (component[g] != kNone) continue;
    component[g] = g;
    queue.assign(1, g);
    for (std::size_t head = 0; head < queue.size(); ++head)
      for (auto n = graph.begin(queue[head]); n != graph.end(queue[head]); ++n)
        if (component[n->group] == kNone) {
          component[n->group] = g;
          queue.push_back(n->group);
        }
  }
  return component;
}

/// Builds a binary tree level by level: holds the groups of the current level, and the tree below
/// them. Groups have numbers on their level; the tree's nodes have numbers that stay.
class Levels {
 public:
  /// The lowest level: each primitive is a group.
  Levels(const MeshView<double>& mesh, unsigned count) : groups_(count), boxes_(count) {
    tree_.leaves = count;
    tree_.children.reserve(count - 1);
    boxes_.reserve(2 * static_cast<std::size_t>(count));
    for (unsigned t = 0; t < count; ++t) {
      groups_[t] = t;
      mesh.forEachPosition(t, [&](const fcl::Vector3d& p) { boxes_[t].extend(p); });
    }
  }

  /// Pairs neighbours until every component is one group. `links` are those of the lowest level.
  void mergeConnected(Scratch<Link> links) {
    Scratch<unsigned> component;
    while (!links.empty()) {
      if (size() == 2) return mergeLastTwo();
      const GroupGraph graph(size(), links);
      if (component.empty()) component = components(graph);
      const Scratch<unsigned> new_number = merge(pairAll(graph, component));
      component = renumbered(component, new_number);
      links = contracted(links, new_number);
    }
  }

  /// Pairs groups that are near each other until one is left.
  void mergeNear() {
    isolated_.clear();
    while (size() > 1) {
      sortAlongCurve();
      if (size() == 2) return mergeLastTwo();
      const Scratch<unsigned> one_component(size(), 0);
      merge(pairAll(GroupGraph(size(), proximityLinks(boxes(groups_))), one_component));
    }
  }

  BinaryTree take() { return std::move(tree_); }

 private:
  unsigned size() const { return static_cast<unsigned>(groups_.size()); }

  Scratch<AlignedBox> boxes(const Scratch<unsigned>& nodes) const {
    Scratch<AlignedBox> result;
    result.reserve(nodes.size());
    for (unsigned node : nodes) result.push_back(boxes_[node]);
    return result;
  }

  /// Pairs all groups, except groups without neighbours and one in each component of odd size.
  /// Returns the mate of each group, or kNone. Groups that `pairGroups` leaves unpaired are paired
  /// with others of their component along a Morton curve.
  Scratch<unsigned> pairAll(const GroupGraph& graph, const Scratch<unsigned>& component) const {
    Scratch<unsigned> mate = pairGroups(graph, isolated_), rest, nodes;
    for (unsigned g = 0; g < size(); ++g)
      if (mate[g] == kNone && graph.begin(g) != graph.end(g)) {
        rest.push_back(g);
        nodes.push_back(groups_[g]);
      }
    if (rest.empty()) return mate;
    Scratch<unsigned> order = mortonOrder(boxes(nodes));
    for (unsigned& group : order) group = rest[group];
    std::stable_sort(order.begin(), order.end(),
                     [&](unsigned a, unsigned b) { return component[a] < component[b]; });
    for (std::size_t i = 1; i < order.size(); ++i) {
      const unsigned a = order[i - 1], b = order[i];
      if (component[a] != component[b] || mate[a] != kNone) continue;
      mate[a] = b;
      mate[b] = a;
    }
    return mate;
  }

  /// Goes to the next level. Its groups are the unpaired groups, then the pairs. Returns the number
  /// that each group, or the pair with it, has there.
  Scratch<unsigned> merge(const Scratch<unsigned>& mate) {
    Scratch<unsigned> new_number(size()), next;
    next.reserve(size());
    isolated_.clear();
    for (unsigned g = 0; g < size(); ++g)
      if (mate[g] == kNone) {
        new_number[g] = static_cast<unsigned>(next.size());
        isolated_.push_back(new_number[g]);
        next.push_back(groups_[g]);
      }
    for (unsigned g = 0; g < size(); ++g)
      if (mate[g] != kNone && g < mate[g]) {
        new_number[g] = new_number[mate[g]] = static_cast<unsigned>(next.size());
        next.push_back(join(groups_[g], groups_[mate[g]]));
      }
    groups_.swap(next);
    return new_number;
  }

  /// Shortcut with the same result as pairing two neighbours.
  void mergeLastTwo() { groups_.assign(1, join(groups_[0], groups_[1])); }

  /// Adds a node with two children to the tree. Returns its number.
  unsigned join(unsigned left, unsigned right) {
    tree_.children.push_back({left, right});
    boxes_.push_back(boxes_[left].merged(boxes_[right]));
    return static_cast<unsigned>(boxes_.size()) - 1;
  }

  /// The components of the groups of the new level, after merge().
  Scratch<unsigned> renumbered(const Scratch<unsigned>& old,
                               const Scratch<unsigned>& new_number) const {
    Scratch<unsigned> component(size());
    for (std::size_t g = 0; g < old.size(); ++g) component[new_number[g]] = old[g];
    return component;
  }

  /// The links of the groups of the new level, after merge().
  Scratch<Link> contracted(Scratch<Link>& links, const Scratch<unsigned>& new_number) const {
    for (Link& link : links) {
      const auto ends = std::minmax(new_number[link.first], new_number[link.second]);
      link.first = ends.first;
      link.second = ends.second;
    }
    return combined(size(), links);
  }

  /// Renumbers the groups along a Morton curve.
  void sortAlongCurve() {
    const Scratch<unsigned> order = mortonOrder(boxes(groups_));
    Scratch<unsigned> sorted, isolated;
    sorted.reserve(size());
    for (unsigned g : order) {
      if (std::binary_search(isolated_.begin(), isolated_.end(), g))
        isolated.push_back(static_cast<unsigned>(sorted.size()));
      sorted.push_back(groups_[g]);
    }
    groups_.swap(sorted);
    isolated_.swap(isolated);
  }

  BinaryTree tree_;
  Scratch<unsigned> groups_;    // tree node of each group of the level
  Scratch<unsigned> isolated_;  // groups left unpaired on the previous level, ascending
  Scratch<AlignedBox> boxes_;   // bounding box of each node
};

}  // namespace

BinaryTree buildBottomUp(const MeshView<double>& mesh, unsigned count) {
  Levels levels(mesh, count);
  if (mesh.triangles) levels.mergeConnected(sharedEdges(mesh, count));
  levels.mergeNear();
  return levels.take();
}

OrderedTree::OrderedTree(const BinaryTree& tree) {
  struct Open {
    unsigned binary_node;  // a node of `tree`
    int parent;            // its parent in `nodes`
    bool is_right;
  };
  const std::size_t size = tree.leaves + tree.children.size();
  Scratch<unsigned> counts(size, 1);  // the number of leaves below each node of `tree`
  for (std::size_t i = 0; i < tree.children.size(); ++i)
    counts[tree.leaves + i] = counts[tree.children[i][0]] + counts[tree.children[i][1]];
  nodes.reserve(size);
  primitives.reserve(tree.leaves);
  Scratch<Open> open(1, Open{static_cast<unsigned>(size) - 1, -1, false});
  while (!open.empty()) {
    const auto [binary_node, parent, is_right] = open.back();
    open.pop_back();
    const auto number = static_cast<int>(nodes.size());
    if (parent >= 0) {
      Node& above = nodes[static_cast<std::size_t>(parent)];
      (is_right ? above.right : above.left) = number;
    }
    nodes.push_back({-1, -1, static_cast<unsigned>(primitives.size()), counts[binary_node]});
    if (binary_node < tree.leaves) {
      primitives.push_back(binary_node);
      continue;
    }
    const std::array<unsigned, 2>& children = tree.children[binary_node - tree.leaves];
    open.push_back({children[1], number, true});
    open.push_back({children[0], number, false});
  }
}

namespace {

/// Whether the numbers are 0, 1, 2 and so on, in any order.
bool isPermutation(const Scratch<unsigned>& primitives) {
  std::vector<bool> is_taken(primitives.size(), false);
  for (const unsigned p : primitives) {
    if (p >= primitives.size() || is_taken[p]) return false;
    is_taken[p] = true;
  }
  return true;
}

/// Sets the children and first leaves of all nodes, given in depth-first order: a node that follows
/// an inner node is its left child; a node that follows a leaf is the right child of the last inner
/// node that has none. Returns false if the shape is not one binary tree with this number of
/// leaves, or if it is deeper than trees of buildBottomUp.
bool linkNodes(const std::vector<bool>& shape, std::size_t leaves,
               Scratch<OrderedTree::Node>& nodes) {
  struct Open {
    int node, depth;
  };
  const int deepest = 2 * static_cast<int>(std::ceil(std::log2(double(leaves) + 1)));
  Scratch<Open> open;  // nodes that have no right child yet
  unsigned leaf_count = 0;
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
    nodes[i] = {-1, -1, leaf_count, 1};
    if (shape[i])
      ++leaf_count;
    else
      open.push_back({number, depth});
  }
  return open.empty() && leaf_count == leaves;
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
