#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "node_graph.h"

namespace adaptive_bvh {

/// Collada's nodes while a text is read. The visual scenes count as nodes.
class ColladaNodes {
 public:
  /// Into an element; its tag is without brackets.
  void enter(const std::string& tag);
  /// Out of the last one that is open.
  void leave();
  /// Elements that are open.
  std::size_t levels() const { return open_.size(); }

  /// At the end of the text: what is wrong with the hierarchy; empty when nothing is.
  std::string findError();

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  void addNode(std::map<std::string, std::string> attributes, std::size_t parent);
  void link(std::size_t parent, const std::string& id);

  std::vector<std::size_t> open_;  ///< for each element the node that it is in, or is
  std::vector<std::size_t> root_;  ///< for each node the one above it that is in no other
  NodeGraph children_;
  std::vector<std::pair<std::size_t, std::string>> instances_;  ///< in which node, and the url
  std::map<std::string, std::vector<std::size_t>> library_;     ///< nodes in no other, by id
  std::map<std::string, std::vector<std::size_t>> by_name_;     ///< the first under each root
  bool has_references_ = false;
};

}  // namespace adaptive_bvh
