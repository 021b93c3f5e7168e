// Parses XML, as far as Collada, AMF and 3MF need it.
#include "xml.h"

#include <algorithm>

#include "scene.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

/// Normalizes an attribute value as XML requires: a line break or a tab becomes a space.
std::string withPlainSpaces(std::string_view value) {
  std::string plain;
  plain.reserve(value.size());
  for (std::size_t at = 0; at < value.size(); ++at)
    if (value.compare(at, 2, "\r\n") != 0) plain += isSpace(value[at]) ? ' ' : value[at];
  return plain;
}

class XmlParser {
 public:
  explicit XmlParser(const std::string& text) : text_(text) {}

  XmlElement parse() {
    XmlElement document;
    open_ = {&document};
    for (;;) {
      const std::size_t bracket = std::min(text_.find('<', position_), text_.size());
      if (open_.size() > 1) open_.back()->text.append(text_, position_, bracket - position_);
      position_ = bracket;
      if (position_ >= text_.size()) break;
      if (!skipOther()) readTag();
    }
    if (open_.size() > 1 || document.children.empty())
      throw std::runtime_error("its XML text ends within an element");
    return std::move(document.children.front());
  }

 private:
  /// Skips a comment, an instruction or the document type, and appends a section of plain text to
  /// the open element. Returns false for anything else.
  bool skipOther() {
    for (const auto& [begin, end] :
         {std::pair<const char*, const char*>{"<!--", "-->"}, {"<?", "?>"}, {"<![CDATA[", "]]>"}}) {
      if (text_.compare(position_, std::string_view(begin).size(), begin) != 0) continue;
      const std::size_t from = position_;
      position_ = std::min(text_.find(end, from), text_.size());
      position_ = std::min(position_ + std::string_view(end).size(), text_.size());
      if (begin[2] == '[') open_.back()->text.append(text_, from, position_ - from);
      return true;
    }
    if (text_.compare(position_, 2, "<!") != 0) return false;
    if (readToEndOfTag().find('[') != std::string::npos)
      throw std::runtime_error("its document type has declarations");
    return true;
  }

  /// The content of the tag at the current position, up to its closing bracket; ignores quoted
  /// brackets. Continues after the tag.
  std::string_view readToEndOfTag() {
    const std::size_t begin = ++position_;
    char quote = '\0';
    for (; position_ < text_.size() && (quote || text_[position_] != '>'); ++position_)
      if (quote ? text_[position_] == quote : text_[position_] == '"' || text_[position_] == '\'')
        quote = quote ? '\0' : text_[position_];
    if (position_ >= text_.size()) throw std::runtime_error("its XML text ends within a tag");
    return std::string_view(text_).substr(begin, position_++ - begin);
  }

  /// Reads a tag that begins an element, ends one, or both.
  void readTag() {
    std::string_view tag = readToEndOfTag();
    if (tag.substr(0, 1) == "/") {
      if (open_.size() == 1 || Words(tag).next().substr(1) != open_.back()->name)
        throw std::runtime_error("an end tag does not match the open element: '" +
                                 std::string(tag.substr(1, 40)) + "'");
      open_.pop_back();
      return;
    }
    const bool is_empty = !tag.empty() && tag.back() == '/';
    if (is_empty) tag.remove_suffix(1);
    open_.back()->children.emplace_back();
    XmlElement& element = open_.back()->children.back();
    readAttributes(tag, element);
    open_.push_back(&element);
    if (open_.size() - 1 > kMostLevels)
      throw std::runtime_error("its elements are nested in more than " +
                               std::to_string(kMostLevels) + " levels");
    if (is_empty) open_.pop_back();
  }

  /// Reads the name and the attributes of an element from its tag.
  static void readAttributes(std::string_view tag, XmlElement& element) {
    const auto skip = [&](std::size_t at) {
      while (at < tag.size() && isSpace(tag[at])) ++at;
      return at;
    };
    std::size_t at = 0;
    while (at < tag.size() && !isSpace(tag[at])) ++at;
    element.name = tag.substr(0, at);
    for (at = skip(at); at < tag.size(); at = skip(at)) {
      const std::size_t name = at;
      while (at < tag.size() && !isSpace(tag[at]) && tag[at] != '=') ++at;
      const std::size_t name_end = at;
      at = skip(at);
      if (at >= tag.size() || tag[at] != '=') break;
      at = skip(at + 1);
      const std::size_t end = at < tag.size() ? tag.find(tag[at], at + 1) : tag.npos;
      if (end == tag.npos) break;
      element.attributes.emplace_back(tag.substr(name, name_end - name),
                                      withPlainSpaces(tag.substr(at + 1, end - at - 1)));
      at = end + 1;
    }
  }

  const std::string& text_;
  std::size_t position_ = 0;
  std::vector<XmlElement*> open_;  ///< the document, and all unclosed elements
};

}  // namespace

const XmlElement& XmlElement::child(const std::string& wanted) const {
  static const XmlElement kNone;
  for (const XmlElement& element : children)
    if (element.name == wanted) return element;
  return kNone;
}

std::string XmlElement::attribute(const std::string& wanted, const std::string& otherwise) const {
  for (const auto& [name, value] : attributes)
    if (name == wanted) return value;
  return otherwise;
}

XmlElement parseXml(const std::string& text) {
  if (text.find('\0') != text.npos) throw std::runtime_error("its text is not in UTF-8");
  return XmlParser(text).parse();
}

}  // namespace adaptive_bvh
