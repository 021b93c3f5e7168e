#include "collada_nodes.h"

#include <algorithm>

#include "xml_tags.h"

namespace adaptive_bvh {

void ColladaNodes::enter(const std::string& tag) {
  const std::string name = nameOf(tag);
  const std::size_t parent = open_.empty() ? kNone : open_.back();
  open_.push_back(parent);
  if (name == "node" || name == "visual_scene")
    addNode(attributesOf(tag), parent);
  else if (name == "instance_node" && parent != kNone)
    instances_.emplace_back(parent, attributesOf(tag)["url"]);
}

void ColladaNodes::leave() {
  if (!open_.empty()) open_.pop_back();
}

std::string ColladaNodes::findError() {
  if (!instances_.empty() && has_references_)
    return "it instances nodes, and has character references in the names of some";
  for (const auto& [parent, url] : instances_) {
    if (url.find_first_of("&<>\"'") != url.npos) return "it instances a node of no valid name";
    link(parent, url.substr(std::min<std::size_t>(1, url.size())));  // without the '#'
  }
  return findHierarchyError(children_);
}

void ColladaNodes::addNode(std::map<std::string, std::string> attributes, std::size_t parent) {
  const std::size_t node = children_.size();
  const std::string &id = attributes["id"], &name = attributes["name"];
  has_references_ |= id.find("&#") != id.npos || name.find("&#") != name.npos;
  children_.emplace_back();
  root_.push_back(parent == kNone ? node : root_[parent]);
  open_.back() = node;
  if (parent == kNone)
    library_[id].push_back(node);
  else
    children_[parent].push_back(node);
  for (const std::string& key : {id, name}) {
    std::vector<std::size_t>& named = by_name_[key];
    if (named.empty() || root_[named.back()] != root_[node]) named.push_back(node);
  }
}

/// As assimp does: to what has this id and is in no other node; or else to the first in the scene
/// that has this id or name. Which scene is not known here: to the first of each.
void ColladaNodes::link(std::size_t parent, const std::string& id) {
  const auto in_library = library_.find(id);
  const auto anywhere = by_name_.find(id);
  if (in_library != library_.end())
    for (const std::size_t node : in_library->second) children_[parent].push_back(node);
  else if (anywhere != by_name_.end())
    for (const std::size_t node : anywhere->second) children_[parent].push_back(node);
}

}  // namespace adaptive_bvh
