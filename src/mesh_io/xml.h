#pragma once

#include <string>
#include <utility>
#include <vector>

namespace adaptive_bvh {

struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< names and values
  std::string text;  ///< its own text, without that of child elements; references are not resolved
  std::vector<XmlElement> children;

  /// The first child with that name; an empty element if there is none.
  const XmlElement& child(const std::string& wanted) const;
  /// The value of the first attribute with that name; `otherwise` if there is none.
  std::string attribute(const std::string& wanted, const std::string& otherwise = "") const;
};

/// Parses an XML text in UTF-8 and returns its root. Skips comments and instructions. Throws
/// std::runtime_error if there are more than `kMostLevels` levels, if tags do not match, or if the
/// document type has declarations, because these could hide elements.
XmlElement parseXml(const std::string& text);

}  // namespace adaptive_bvh
