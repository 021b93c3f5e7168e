#pragma once

#include <map>
#include <string>

namespace adaptive_bvh {

/// The name of an element, from its tag without brackets.
std::string nameOf(const std::string& tag);

/// The attributes of a tag without brackets; of two with one name the first. Entities are not
/// replaced.
std::map<std::string, std::string> attributesOf(const std::string& tag);

/// Reads the tags of an XML text one after another; comments, plain text and instructions are
/// skipped.
class XmlTags {
 public:
  enum Kind {
    Start,
    End,
    Empty,  ///< start and end in one
    Type,   ///< the document type
    None,   ///< the text is over
  };

  /// Keeps a reference to the text.
  explicit XmlTags(const std::string& text) : text_(text) {}

  Kind next();

  /// Of the last one, without brackets.
  const std::string& tag() const { return tag_; }
  /// The text between it and the next bracket; empty for an empty element.
  std::string content() const;
  /// Whether nothing else stands in the element: no other element, comment or section.
  bool isLeaf() const;

 private:
  const std::string& text_;
  std::size_t at_ = 0;  ///< after the last tag
  Kind kind_ = None;
  std::string tag_;
};

}  // namespace adaptive_bvh
