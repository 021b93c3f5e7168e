#include <algorithm>
#include <initializer_list>
#include <map>
#include <vector>

#include "formats.h"
#include "tokens.h"
#include "xml_tags.h"

namespace adaptive_bvh {
namespace {

using Attributes = std::map<std::string, std::string>;

std::string valueOr(const Attributes& attributes, const char* name, const char* otherwise) {
  const auto found = attributes.find(name);
  return found == attributes.end() ? otherwise : found->second;
}

bool isOneOf(std::initializer_list<const char*> names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::size_t wordsIn(const std::string& text) {
  std::size_t words = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    words += !isSpace(text[i]) && (i == 0 || isSpace(text[i - 1]));
  return words;
}

/// assimp never passes what is no number in a list. It reads the first text that is not blank, also
/// behind a comment or another element.
bool isListOfIndices(const XmlTags& tags) {
  const std::string text = tags.content();
  return text.find_first_not_of("0123456789+- \t\r\n") == text.npos &&
         (tags.isLeaf() || wordsIn(text) > 0);
}

/// The elements that hold numbers, while a text is read.
class ColladaData {
 public:
  explicit ColladaData(std::size_t bytes) : bytes_(bytes) {}

  /// What is wrong with the element whose tag was read last; empty when nothing is.
  std::string add(const XmlTags& tags) {
    const std::string &tag = tags.tag(), name = nameOf(tag);
    if (isOneOf(
            {"float_array", "int_array", "bool_array", "Name_array", "IDREF_array", "SIDREF_array"},
            name))
      return addArray(attributesOf(tag), tags.content());
    if (name == "accessor") accessors_.push_back(attributesOf(tag));
    if (isOneOf({"triangles", "polylist", "polygons", "lines", "tristrips"}, name))
      return findCountError("faces", valueOr(attributesOf(tag), "count", "0"), bytes_);
    if (isOneOf({"p", "h", "v", "vcount"}, name) && !isListOfIndices(tags))
      return "a list of indices has something else in it";
    return "";
  }

  /// At the end of the text.
  std::string findError() const {
    return std::all_of(accessors_.begin(), accessors_.end(),
                       [this](const Attributes& accessor) { return isWithinArray(accessor); })
               ? ""
               : "an accessor reaches past its array";
  }

 private:
  std::string addArray(const Attributes& attributes, const std::string& content) {
    const std::uintmax_t count = countOf(valueOr(attributes, "count", ""));
    if (count > wordsIn(content)) return "an array has fewer values than it announces";
    values_[valueOr(attributes, "id", "")] = count;
    return "";
  }

  bool isWithinArray(const Attributes& accessor) const {
    const std::string source = valueOr(accessor, "source", "#");
    const auto array = values_.find(source.substr(std::min<std::size_t>(1, source.size())));
    const std::uintmax_t count = countOf(valueOr(accessor, "count", ""));
    const std::uintmax_t stride = countOf(valueOr(accessor, "stride", "1"));
    const std::uintmax_t offset = countOf(valueOr(accessor, "offset", "0"));
    return array != values_.end() && count <= bytes_ && stride <= bytes_ && offset <= bytes_ &&
           offset + count * stride <= array->second;
  }

  std::size_t bytes_;                             ///< of the whole text
  std::map<std::string, std::uintmax_t> values_;  ///< in the arrays, by their ids
  std::vector<Attributes> accessors_;
};

}  // namespace

std::string findColladaDataError(const std::string& text) {
  ColladaData data(text.size());
  XmlTags tags(text);
  for (auto kind = tags.next(); kind != XmlTags::None; kind = tags.next()) {
    if (kind != XmlTags::Start && kind != XmlTags::Empty) continue;
    const std::string error = data.add(tags);
    if (!error.empty()) return error;
  }
  return data.findError();
}

}  // namespace adaptive_bvh
