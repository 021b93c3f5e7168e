#include "mesh_io/objection.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <vector>

#include "mesh_io/gltf_format.h"
#include "mesh_io/xml_format.h"

namespace adaptive_bvh {
namespace {

/// A count as written; larger than any file when it is not one.
std::uintmax_t countOf(const std::string& text) {
  if (text.empty() || text.size() > 18 || text.find_first_not_of("0123456789") != text.npos)
    return UINTMAX_MAX;
  return std::stoull(text);
}

/// Little-endian.
std::uint32_t wordAt(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t k = 4; k-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[at + k]);
  return word;
}

/// "nan" and "inf" included.
bool isNumber(const std::string& word) {
  char* end = nullptr;
  std::strtod(word.c_str(), &end);
  return !word.empty() && *end == '\0';
}

/// Every element takes a byte at least.
std::string checkCount(const std::string& what, const std::string& count, std::size_t bytes) {
  if (countOf(count) <= bytes) return "";
  return "it announces '" + count + "' " + what + ", and has " + std::to_string(bytes) + " bytes";
}

// ---- PLY ----------------------------------------------------------------------------------------

/// Bytes of a type of PLY; 0 for a word that is none.
int sizeOf(const std::string& type) {
  for (const char* name : {"char", "uchar", "int8", "uint8"})
    if (type == name) return 1;
  for (const char* name : {"short", "ushort", "int16", "uint16"})
    if (type == name) return 2;
  for (const char* name : {"int", "uint", "int32", "uint32", "float", "float32"})
    if (type == name) return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

struct PlyProperty {
  bool is_list = false;
  int count_bytes = 0;  ///< of a list
  int bytes = 0;        ///< of a value
};

struct PlyElement {
  std::string name;
  std::uintmax_t count = 0;
  std::vector<PlyProperty> properties;
};

/// The body, value by value.
class PlyBody {
 public:
  PlyBody(const std::string& text, std::size_t start, bool is_ascii, bool is_big_endian)
      : text_(text), at_(start), is_ascii_(is_ascii), is_big_endian_(is_big_endian) {}

  /// Skips values of so many bytes; false when they are not there.
  bool skip(std::uintmax_t values, int bytes) {
    if (!is_ascii_) {
      if (values > (text_.size() - at_) / static_cast<std::size_t>(bytes)) return false;
      at_ += static_cast<std::size_t>(values) * static_cast<std::size_t>(bytes);
      return true;
    }
    for (; values > 0; --values)
      if (!isNumber(word())) return false;
    return true;
  }

  /// Reads the number of values of a list; false when it is not there.
  bool readCount(int bytes, std::uintmax_t& count) {
    if (is_ascii_) {
      count = countOf(word());
      return count < UINTMAX_MAX;
    }
    const std::size_t start = at_;
    if (bytes > 4 || !skip(1, bytes)) return false;
    count = 0;
    for (int k = 0; k < bytes; ++k) {
      const int i = is_big_endian_ ? k : bytes - 1 - k;
      count = count << 8 | static_cast<unsigned char>(text_[start + static_cast<std::size_t>(i)]);
    }
    return true;
  }

 private:
  std::string word() {
    while (at_ < text_.size() && isSpace(text_[at_])) ++at_;
    const std::size_t start = at_;
    while (at_ < text_.size() && !isSpace(text_[at_])) ++at_;
    return text_.substr(start, at_ - start);
  }

  const std::string& text_;
  std::size_t at_;
  const bool is_ascii_, is_big_endian_;
};

std::string checkPly(const std::string& text) {
  std::vector<PlyElement> elements;
  std::string format;
  std::size_t at = 0;
  for (bool ended = false; !ended;) {
    const std::size_t end = text.find_first_of("\r\n", at);
    if (end == text.npos) return "its header does not end";
    std::istringstream words(text.substr(at, end - at));
    at = text.compare(end, 2, "\r\n") == 0 ? end + 2 : end + 1;
    std::string keyword, a, b, c;
    words >> keyword >> a >> b >> c;
    if (keyword == "format") {
      format = a;
    } else if (keyword == "element") {
      const std::string objection = checkCount("elements '" + a + "'", b, text.size());
      if (!objection.empty()) return objection;
      elements.push_back({a, countOf(b), {}});
    } else if (keyword == "property") {
      const bool is_list = a == "list";
      const PlyProperty property{is_list, is_list ? sizeOf(b) : 0, sizeOf(is_list ? c : a)};
      if (elements.empty() || property.bytes == 0 || (is_list && property.count_bytes == 0))
        return "its header has a property of no known type";
      elements.back().properties.push_back(property);
    }
    ended = keyword == "end_header";
  }
  const bool is_big_endian = format == "binary_big_endian";
  if (format != "ascii" && format != "binary_little_endian" && !is_big_endian)
    return "its header names no known format";

  PlyBody body(text, at, format == "ascii", is_big_endian);
  for (const PlyElement& element : elements)
    for (std::uintmax_t i = 0; i < element.count; ++i)
      for (const PlyProperty& property : element.properties) {
        std::uintmax_t values = 1;
        if ((property.is_list && !body.readCount(property.count_bytes, values)) ||
            !body.skip(values, property.bytes))
          return "it ends, or makes no sense, within element " + std::to_string(i) + " of " +
                 std::to_string(element.count) + " '" + element.name + "'";
      }
  return "";
}

// ---- STL ----------------------------------------------------------------------------------------

/// Text: facets of three vertices each, from the first word to the last.
std::string checkStl(const std::string& text) {
  constexpr std::size_t kHeader = 84, kFacet = 50;
  if (text.size() >= kHeader && (text.size() - kHeader) % kFacet == 0 &&
      (text.size() - kHeader) / kFacet == wordAt(text, kHeader - 4))
    return "";  // binary, whatever its first word
  std::istringstream words(text);
  std::string word, x, y, z;
  int corners = -1;  // of the facet that is open
  bool is_solid_open = false;
  while (words >> word) {
    if (word == "solid") {
      std::getline(words, x);  // its name
      is_solid_open = true;
    } else if (word == "facet") {
      if (corners >= 0 || !(words >> word >> x >> y >> z) || !isNumber(x) || !isNumber(y) ||
          !isNumber(z))
        return "a facet begins within another, or without a normal";
      corners = 0;
    } else if (word == "vertex") {
      if (corners < 0 || ++corners > 3 || !(words >> x >> y >> z) || !isNumber(x) || !isNumber(y) ||
          !isNumber(z))
        return "a vertex is out of place, or not three numbers";
    } else if (word == "endfacet") {
      if (corners != 3) return "a facet does not have three vertices";
      corners = -1;
    } else if (word == "endsolid") {
      std::getline(words, x);
      is_solid_open = false;
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      return "there is an unknown word in it";
    }
  }
  return corners >= 0 || is_solid_open ? "it ends within a solid" : "";
}

// ---- others -------------------------------------------------------------------------------------

std::string checkOff(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);  // the keyword
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string vertices, faces;
    if (!(words >> vertices) || vertices[0] == '#') continue;
    words >> faces;
    const std::string objection = checkCount("vertices", vertices, text.size());
    return !objection.empty() ? objection : checkCount("faces", faces, text.size());
  }
  return "";
}

/// Calls visit(tag, its text up to the next tag) for every element of that name; stops at the first
/// objection. No entities, no comments: what those hide is not found, and objected to.
template <typename Visit>
std::string forEachElement(const std::string& text, const std::string& name, Visit&& visit) {
  const std::string start = "<" + name;
  for (std::size_t at = 0; (at = text.find(start, at)) != text.npos;) {
    const std::size_t begin = at;
    at += start.size();
    if (at < text.size() && text[at] != '>' && text[at] != '/' && !isSpace(text[at])) continue;
    at = std::min(text.find('>', at), text.size());
    const std::size_t end = std::min(text.find('<', at), text.size());
    const std::size_t content = std::min(at + 1, end);
    const std::string objection =
        visit(text.substr(begin, at - begin), text.substr(content, end - content));
    if (!objection.empty()) return objection;
  }
  return "";
}

/// Of a tag; `otherwise` where it has none.
std::string attribute(const std::string& tag, const std::string& name,
                      const std::string& otherwise = "") {
  for (std::size_t at = 0; (at = tag.find(name + "=", at)) != tag.npos; ++at) {
    if (at == 0 || !isSpace(tag[at - 1])) continue;
    const std::size_t quote = at + name.size() + 1;
    const std::size_t end = quote < tag.size() ? tag.find(tag[quote], quote + 1) : tag.npos;
    return end == tag.npos ? "" : tag.substr(quote + 1, end - quote - 1);
  }
  return otherwise;
}

std::size_t wordsIn(const std::string& text) {
  std::size_t words = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    words += !isSpace(text[i]) && (i == 0 || isSpace(text[i - 1]));
  return words;
}

std::string checkCollada(const std::string& text) {
  std::string objection;
  const auto check = [&](const std::string& name, auto&& visit) {
    if (objection.empty()) objection = forEachElement(text, name, visit);
  };

  std::map<std::string, std::uintmax_t> values;  // in the arrays, by their ids
  for (const char* array :
       {"float_array", "int_array", "bool_array", "Name_array", "IDREF_array", "SIDREF_array"})
    check(array, [&](const std::string& tag, const std::string& content) -> std::string {
      const std::uintmax_t count = countOf(attribute(tag, "count"));
      if (count > wordsIn(content)) return "an array has fewer values than it announces";
      values[attribute(tag, "id")] = count;
      return "";
    });
  check("accessor", [&](const std::string& tag, const std::string&) -> std::string {
    const std::string source = attribute(tag, "source", "#");
    const auto array = values.find(source.substr(std::min<std::size_t>(1, source.size())));
    const std::uintmax_t count = countOf(attribute(tag, "count"));
    const std::uintmax_t stride = countOf(attribute(tag, "stride", "1"));
    const std::uintmax_t offset = countOf(attribute(tag, "offset", "0"));
    const std::uintmax_t most = text.size();
    if (array == values.end() || count > most || stride > most || offset > most ||
        offset + count * stride > array->second)
      return "an accessor reaches past its array";
    return "";
  });
  for (const char* primitives : {"triangles", "polylist", "polygons", "lines", "tristrips"})
    check(primitives, [&](const std::string& tag, const std::string&) {
      return checkCount("faces", attribute(tag, "count", "0"), text.size());
    });
  // What is no number in a list of indices is never passed.
  for (const char* list : {"p", "h", "v", "vcount"})
    check(list, [&](const std::string&, const std::string& content) {
      return content.find_first_not_of("0123456789+- \t\r\n") == content.npos
                 ? ""
                 : "a list of indices has something else in it";
    });
  return objection;
}

std::string checkGlb(const std::string& bytes) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  for (std::size_t at = kHeader; at + kChunkHeader <= bytes.size();) {
    const std::size_t length = wordAt(bytes, at);
    at += kChunkHeader;
    if (length > bytes.size() - at)
      return "it announces a chunk of " + std::to_string(length) + " bytes, and has " +
             std::to_string(bytes.size() - at);
    at += length;
  }
  if (bytes.size() < kHeader + kChunkHeader) return "its header does not end";
  return findGltfError(bytes.substr(kHeader + kChunkHeader, wordAt(bytes, kHeader)));
}

std::string checkXml(const std::string& text) {
  const std::string objection = findXmlError(text);
  return objection.empty() && text.find("<COLLADA") != text.npos ? checkCollada(text) : objection;
}

/// In lower case, without the dot.
std::string extensionOf(const std::string& path) {
  std::string extension = path.substr(path.find_last_of('.') + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

}  // namespace

std::string objectionTo(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(4096, '\0');
  file.read(&text[0], static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));

  const std::string extension = extensionOf(path);
  const std::string keyword = text.substr(0, text.find_first_of(" \t\r\n"));
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  const auto check =
      text.compare(0, 4, "glTF") == 0                                             ? checkGlb
      : extension == "gltf"                                                       ? findGltfError
      : extension == "dae"                                                        ? checkXml
      : keyword == "ply" || keyword == "PLY"                                      ? checkPly
      : keyword.size() >= 3 && keyword.compare(keyword.size() - 3, 3, "OFF") == 0 ? checkOff
      : keyword == "solid"                                                        ? checkStl
      : (first != text.npos && text[first] == '<') || text.find("<COLLADA") != text.npos ? checkXml
                                                                                         : nullptr;
  if (!check) return "";
  text.append(std::istreambuf_iterator<char>(file), {});
  return check(text);
}

}  // namespace adaptive_bvh
