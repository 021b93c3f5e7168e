#pragma once

#include <string>
#include <utility>
#include <vector>

namespace adaptive_bvh {

struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< names and values
  std::string text;  ///< all of its own, without that of its elements; references stay as written
  std::vector<XmlElement> children;

  /// The first element of that name; an empty one where there is none.
  const XmlElement& child(const std::string& wanted) const;
  /// The value of the first attribute of that name; `otherwise` where there is none.
  std::string attribute(const std::string& wanted, const std::string& otherwise = "") const;
};

/// The root of an XML text in UTF-8. Comments and instructions are skipped. Throws
/// std::runtime_error on more than `kMostLevels`, on a document type with declarations, which could
/// hide elements, and where tags do not match.
XmlElement parseXml(const std::string& text);

}  // namespace adaptive_bvh
