#include "xml_tags.h"

#include <algorithm>
#include <utility>

#include "tokens.h"

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

std::string nameOf(const std::string& tag) {
  return std::string(tag.begin(), std::find_if(tag.begin(), tag.end(), isSpace));
}

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

XmlTags::Kind XmlTags::next() {
  at_ = text_.find('<', at_);
  for (std::size_t end; at_ < text_.size() && (end = skipOther(text_, at_)) != at_;)
    at_ = text_.find('<', end);
  if (at_ >= text_.size()) return kind_ = None;

  const std::size_t begin = at_;
  at_ = endOfTag(text_, begin);
  const bool is_empty = text_[at_ - 1] == '>' && text_[at_ - 2] == '/';
  const std::size_t end = at_ - 1 - (is_empty ? 1 : 0);
  tag_ = text_.substr(begin + 1, end > begin ? end - begin - 1 : 0);
  if (text_.compare(begin, 2, "<!") == 0) return kind_ = Type;
  if (text_.compare(begin, 2, "</") == 0) return kind_ = End;
  return kind_ = is_empty ? Empty : Start;
}

std::string XmlTags::content() const {
  return kind_ == Empty ? "" : text_.substr(at_, text_.find('<', at_) - at_);
}

bool XmlTags::isLeaf() const {
  const std::size_t bracket = text_.find('<', at_);
  return kind_ == Empty || (bracket != text_.npos && text_.compare(bracket, 2, "</") == 0);
}

}  // namespace adaptive_bvh
