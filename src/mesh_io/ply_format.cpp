#include <sstream>
#include <vector>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

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

struct Property {
  bool is_list = false;
  int count_bytes = 0;  ///< of a list
  int bytes = 0;        ///< of a value
};

struct Element {
  std::string name;
  std::uintmax_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::size_t end = 0;  ///< where the body begins

  bool isAscii() const { return format == "ascii"; }
  bool isBigEndian() const { return format == "binary_big_endian"; }
  bool isKnownFormat() const {
    return isAscii() || isBigEndian() || format == "binary_little_endian";
  }
};

/// One line of the header; `bytes` is the size of the file. Returns what is wrong with it.
std::string readLine(const std::string& line, std::size_t bytes, Header& header) {
  std::istringstream words(line);
  std::string keyword, a, b, c;
  words >> keyword >> a >> b >> c;
  if (keyword == "format") {
    header.format = a;
  } else if (keyword == "element") {
    const std::string error = findCountError("elements '" + a + "'", b, bytes);
    if (!error.empty()) return error;
    header.elements.push_back({a, countOf(b), {}});
  } else if (keyword == "property") {
    const bool is_list = a == "list";
    const Property property{is_list, is_list ? sizeOf(b) : 0, sizeOf(is_list ? c : a)};
    if (header.elements.empty() || property.bytes == 0 || (is_list && property.count_bytes == 0))
      return "its header has a property of no known type";
    header.elements.back().properties.push_back(property);
  }
  return "";
}

bool isLastLine(const std::string& line) {
  std::string keyword;
  std::istringstream(line) >> keyword;
  return keyword == "end_header";
}

std::string readHeader(const std::string& text, Header& header) {
  for (bool ended = false; !ended;) {
    const std::size_t end = text.find_first_of("\r\n", header.end);
    if (end == text.npos) return "its header does not end";
    const std::string line = text.substr(header.end, end - header.end);
    header.end = text.compare(end, 2, "\r\n") == 0 ? end + 2 : end + 1;
    const std::string error = readLine(line, text.size(), header);
    if (!error.empty()) return error;
    ended = isLastLine(line);
  }
  return header.isKnownFormat() ? "" : "its header names no known format";
}

/// The body, value by value.
class Body {
 public:
  Body(const std::string& text, const Header& header)
      : text_(text),
        at_(header.end),
        is_ascii_(header.isAscii()),
        is_big_endian_(header.isBigEndian()) {}

  /// Skips what an element has of a property; false when it is not there.
  bool skip(const Property& property) {
    std::uintmax_t values = 1;
    return (!property.is_list || readCount(property.count_bytes, values)) &&
           skipValues(values, property.bytes);
  }

 private:
  bool skipValues(std::uintmax_t values, int bytes) {
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
    if (bytes > 4 || !skipValues(1, bytes)) return false;
    count = 0;
    for (int k = 0; k < bytes; ++k) {
      const int i = is_big_endian_ ? k : bytes - 1 - k;
      count = count << 8 | static_cast<unsigned char>(text_[start + static_cast<std::size_t>(i)]);
    }
    return true;
  }

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

}  // namespace

std::string findPlyError(const std::string& text) {
  Header header;
  const std::string error = readHeader(text, header);
  if (!error.empty()) return error;
  Body body(text, header);
  for (const Element& element : header.elements)
    for (std::uintmax_t i = 0; i < element.count; ++i)
      for (const Property& property : element.properties)
        if (!body.skip(property))
          return "it ends, or makes no sense, within element " + std::to_string(i) + " of " +
                 std::to_string(element.count) + " '" + element.name + "'";
  return "";
}

}  // namespace adaptive_bvh
