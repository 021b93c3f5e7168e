#include "mesh_io/xml_format.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "mesh_io/node_graph.h"

namespace adaptive_bvh {
namespace {

/// After a start tag that begins at `at`, quoted text skipped; the text's end when it does not end.
std::size_t endOfTag(const std::string& text, std::size_t at) {
  char quote = '\0';
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote) {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at + 1;
    }
  }
  return at;
}

/// As XML has it: a line break or a tab in a value is a space.
std::string withPlainSpaces(std::string value) {
  for (std::size_t at = 0; (at = value.find("\r\n", at)) != value.npos;) value.erase(at, 1);
  std::replace_if(value.begin(), value.end(), isSpace, ' ');
  return value;
}

/// Of a start tag; the first of two with one name.
std::map<std::string, std::string> attributesOf(const std::string& tag) {
  std::map<std::string, std::string> attributes;
  const auto skip = [&](std::size_t at) {
    while (at < tag.size() && isSpace(tag[at])) ++at;
    return at;
  };
  std::size_t at = 0;
  while (at < tag.size() && !isSpace(tag[at])) ++at;  // the element's name
  for (at = skip(at); at < tag.size(); at = skip(at)) {
    const std::size_t name = at;
    while (at < tag.size() && !isSpace(tag[at]) && tag[at] != '=') ++at;
    const std::size_t name_end = at;
    at = skip(at);
    if (at >= tag.size() || tag[at] != '=') break;
    at = skip(at + 1);
    const std::size_t end = at < tag.size() ? tag.find(tag[at], at + 1) : tag.npos;
    if (end == tag.npos) break;
    attributes.emplace(tag.substr(name, name_end - name),
                       withPlainSpaces(tag.substr(at + 1, end - at - 1)));
    at = end + 1;
  }
  return attributes;
}

/// Collada's nodes while a text is read. The visual scenes count as nodes.
class ColladaNodes {
 public:
  /// Into an element; its tag is without brackets.
  void enter(const std::string& tag) {
    const std::string name = tag.substr(
        0, static_cast<std::size_t>(std::find_if(tag.begin(), tag.end(), isSpace) - tag.begin()));
    const std::size_t parent = open_.empty() ? kNone : open_.back();
    open_.push_back(parent);
    if (name == "node" || name == "visual_scene")
      addNode(attributesOf(tag), parent);
    else if (name == "instance_node" && parent != kNone)
      instances_.emplace_back(parent, attributesOf(tag)["url"]);
  }
  void leave() {
    if (!open_.empty()) open_.pop_back();
  }
  std::size_t levels() const { return open_.size(); }

  /// At the end of the text.
  std::string findError() {
    if (!instances_.empty() && has_references_)
      return "it instances nodes, and has character references in the names of some";
    for (const auto& [parent, url] : instances_) {
      if (url.find_first_of("&<>\"'") != url.npos) return "it instances a node of no valid name";
      link(parent, url.substr(std::min<std::size_t>(1, url.size())));  // without the '#'
    }
    return findHierarchyError(children_);
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  void addNode(std::map<std::string, std::string> attributes, std::size_t parent) {
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
  void link(std::size_t parent, const std::string& id) {
    const auto in_library = library_.find(id);
    const auto anywhere = by_name_.find(id);
    if (in_library != library_.end())
      for (const std::size_t node : in_library->second) children_[parent].push_back(node);
    else if (anywhere != by_name_.end())
      for (const std::size_t node : anywhere->second) children_[parent].push_back(node);
  }

  std::vector<std::size_t> open_;  ///< for each element the node that it is in, or is
  std::vector<std::size_t> root_;  ///< for each node the one above it that is in no other
  NodeGraph children_;
  std::vector<std::pair<std::size_t, std::string>> instances_;  ///< in which node, and the url
  std::map<std::string, std::vector<std::size_t>> library_;     ///< nodes in no other, by id
  std::map<std::string, std::vector<std::size_t>> by_name_;     ///< the first under each root
  bool has_references_ = false;
};

/// The end of what begins at `at` and is no element: a comment, a section of plain text, an
/// instruction; `at` itself when it is an element's tag.
std::size_t skipOther(const std::string& text, std::size_t at) {
  for (const auto& [begin, end] :
       {std::pair<const char*, const char*>{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}}) {
    const std::size_t length = std::char_traits<char>::length(begin);
    if (text.compare(at, length, begin) != 0) continue;
    const std::size_t found = text.find(end, at + length);
    return found == text.npos ? text.size() : found + std::char_traits<char>::length(end);
  }
  return at;
}

}  // namespace

std::string findXmlError(const std::string& text) {
  if (text.find('\0') != text.npos) return "its text is not in UTF-8";
  ColladaNodes nodes;
  for (std::size_t at = 0; (at = text.find('<', at)) < text.size();) {
    const std::size_t other = skipOther(text, at);
    if (other != at) {
      at = other;
      continue;
    }
    const std::size_t begin = at;
    at = endOfTag(text, begin);
    if (text.compare(begin, 2, "<!") == 0) {
      if (text.find('[', begin) < at) return "its document type has declarations";
    } else if (text.compare(begin, 2, "</") == 0) {
      nodes.leave();
    } else {
      const bool is_empty = text[at - 1] == '>' && text[at - 2] == '/';
      const std::size_t end = at - 1 - (is_empty ? 1 : 0);
      nodes.enter(text.substr(begin + 1, end > begin ? end - begin - 1 : 0));
      if (nodes.levels() > kMostLevels)
        return "its elements are nested in more than " + std::to_string(kMostLevels) + " levels";
      if (is_empty) nodes.leave();
    }
  }
  return nodes.findError();
}

}  // namespace adaptive_bvh
