#include "node_graph.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

struct NodeState {
  enum { New, Open, Done } state = New;
  std::size_t children_done = 0;
  std::size_t levels = 1;      ///< of its subtree
  std::size_t placements = 1;  ///< nodes of its subtree, once for each way that leads to them
};

}  // namespace

/// Depth first with an explicit stack: children are done before their parents.
std::string findHierarchyError(const NodeGraph& children) {
  const std::size_t most_placements =
      std::max(kMostPlacements, kMostPlacementsPerNode * children.size());
  std::vector<NodeState> nodes(children.size());
  std::vector<std::size_t> path;
  for (std::size_t root = 0; root < children.size(); ++root) {
    if (nodes[root].state == NodeState::New) path.push_back(root);
    while (!path.empty()) {
      const std::size_t at = path.back();
      NodeState& node = nodes[at];
      node.state = NodeState::Open;
      if (node.children_done == children[at].size()) {
        node.state = NodeState::Done;
        path.pop_back();
        continue;
      }
      const std::size_t next = children[at][node.children_done];
      const NodeState& child = nodes[next];
      if (child.state == NodeState::Open) return "a node is among its own descendants";
      if (child.state == NodeState::New) {
        path.push_back(next);
        continue;
      }
      ++node.children_done;
      node.levels = std::max(node.levels, child.levels + 1);
      node.placements += child.placements;  // each at most the limit: no overflow
      if (node.levels > kMostLevels)
        return "its nodes are nested in more than " + std::to_string(kMostLevels) + " levels";
      if (node.placements > most_placements)
        return "its nodes name each other so often that more than " +
               std::to_string(most_placements) + " come of them";
    }
  }
  return "";
}

}  // namespace adaptive_bvh
