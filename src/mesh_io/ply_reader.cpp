// Reads PLY: a header that describes elements, then a body of text or binary numbers.
#include <algorithm>
#include <vector>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

/// The type with this name; kind 0 if there is none.
BinaryType typeOf(std::string_view name) {
  static const struct {
    const char *name, *alias;
    BinaryType type;
  } kTypes[] = {{"char", "int8", {'i', 1}},     {"uchar", "uint8", {'u', 1}},
                {"short", "int16", {'i', 2}},   {"ushort", "uint16", {'u', 2}},
                {"int", "int32", {'i', 4}},     {"uint", "uint32", {'u', 4}},
                {"float", "float32", {'f', 4}}, {"double", "float64", {'f', 8}}};
  for (const auto& entry : kTypes)
    if (name == entry.name || name == entry.alias) return entry.type;
  return {};
}

/// A property of an element: a number, or a list of numbers.
struct Property {
  std::string name;
  BinaryType count;  ///< type of a list's count; kind 0 for a number
  BinaryType value;
};

/// A kind of element, such as "vertex" or "face".
struct Element {
  std::string name;
  std::size_t count = 0;  ///< number of elements in the body
  std::vector<Property> properties;
};

struct PlyHeader {
  std::string format;
  std::vector<Element> elements;  ///< in the order of the body
  std::size_t end = 0;            ///< position of the body in the file
};

Property readProperty(Words& words) {
  Property property;
  std::string_view type = words.next();
  const bool is_list = type == "list";
  if (is_list) {
    property.count = typeOf(words.next());
    type = words.next();
  }
  property.value = typeOf(type);
  property.name = words.next();
  if (property.value.kind == 0 ||
      (is_list && (property.count.kind == 0 || property.count.kind == 'f')))
    throw std::runtime_error("its header has a property of no known type");
  return property;
}

PlyHeader readHeader(std::string_view bytes) {
  PlyHeader header;
  Words lines(bytes);
  for (;;) {
    if (lines.isAtEnd()) throw std::runtime_error("its header does not end");
    Words words(lines.restOfLine());
    const std::string_view keyword = words.next();
    if (keyword == "format") {
      header.format = words.next();
    } else if (keyword == "element") {
      const std::string name(words.next());
      header.elements.push_back(
          {name, countOf("elements " + quote(name), words.next(), bytes.size()), {}});
    } else if (keyword == "property") {
      if (header.elements.empty()) lines.fail("a property has no element");
      header.elements.back().properties.push_back(readProperty(words));
    } else if (keyword == "end_header") {
      break;
    }
  }
  header.end = lines.position();
  // If lines end with "\r" alone, a "\n" is the first byte of the body.
  if (bytes.compare(header.end - 2, 2, "\r\n") == 0 && bytes.find("\r\n") == header.end - 2)
    --header.end;
  return header;
}

/// Throws unless vertices have coordinates.
void checkVertices(const Element& element) {
  for (const char* name : {"x", "y", "z"})
    if (std::none_of(element.properties.begin(), element.properties.end(),
                     [&](const Property& p) { return p.name == name && p.count.kind == 0; }))
      throw std::runtime_error(std::string("its vertices have no property ") + name);
}

/// Reads the numbers of the body in sequence. In a text, every element has its own line.
class Body {
 public:
  Body(std::string_view bytes, const PlyHeader& header)
      : bytes_(bytes), position_(header.end), lines_(bytes, header.end) {
    is_ascii_ = header.format == "ascii";
    is_big_endian_ = header.format == "binary_big_endian";
    if (!is_ascii_ && !is_big_endian_ && header.format != "binary_little_endian")
      throw std::runtime_error("its header names no known format");
  }

  void beginElement() {
    if (is_ascii_ && !nextLine()) throw std::runtime_error("it ends early");
  }

  double next(BinaryType type) { return is_ascii_ ? nextOfLine(type) : nextBinary(type); }

  /// Throws if the line of a text continues.
  void endElement() {
    const std::string_view word = is_ascii_ ? line_.next() : "";
    if (!word.empty()) lines_.fail(quote(word) + " is more than its header announces");
  }

  /// Throws if a text continues after the last element.
  void end() {
    if (is_ascii_ && nextLine()) endElement();
  }

 private:
  /// Reads the next non-empty line; returns false at the end.
  bool nextLine() {
    while (!lines_.isAtEnd()) {
      line_ = Words(lines_.restOfLine());
      if (!Words(line_).next().empty()) return true;
    }
    return false;
  }

  double nextOfLine(BinaryType type) {
    const std::string_view word = line_.next();
    if (word.empty()) lines_.fail("its line ends early");
    const std::optional<double> number = numberOf(word);
    if (!number) lines_.fail(quote(word) + " is no number");
    if (type.kind != 'f' && std::floor(*number) != *number)
      lines_.fail(quote(word) + " is no integer");
    return *number;
  }

  double nextBinary(BinaryType type) {
    if (type.bytes > bytes_.size() - position_) throw std::runtime_error("it ends early");
    position_ += type.bytes;
    return numberAt(bytes_, position_ - type.bytes, type, is_big_endian_);
  }

  const std::string_view bytes_;
  std::size_t position_;  ///< in a binary body
  Words lines_;           ///< the lines of a text
  Words line_{""};        ///< the rest of the current line
  bool is_ascii_, is_big_endian_;
};

class PlyReader {
 public:
  explicit PlyReader(std::string_view bytes)
      : header_(readHeader(bytes)), body_(bytes, header_), bytes_(bytes.size()) {}

  PolygonMesh read() {
    for (const Element& element : header_.elements) {
      if (element.name == "vertex") checkVertices(element);
      if (element.properties.empty()) continue;  // its elements have no bytes
      for (std::size_t i = 0; i < element.count; ++i) try {
          readElement(element);
        } catch (const std::runtime_error& error) {
          throw std::runtime_error("element " + std::to_string(i) + " of " +
                                   std::to_string(element.count) + " " + quote(element.name) +
                                   ": " + error.what());
        }
    }
    body_.end();
    return std::move(mesh_);
  }

 private:
  void readElement(const Element& element) {
    body_.beginElement();
    const bool is_vertex = element.name == "vertex";
    fcl::Vector3d p = fcl::Vector3d::Zero();
    for (const Property& property : element.properties) {
      if (property.count.kind != 0) {
        readList(property);
        if (element.name == "face" && isIndices(property)) addFace();
        if (element.name == "tristrips" && isIndices(property)) addStrips();
        continue;
      }
      const double value = body_.next(property.value);
      for (int k = 0; k < 3 && is_vertex; ++k)
        if (property.name.size() == 1 && property.name[0] == "xyz"[k]) p[k] = value;
    }
    body_.endElement();
    if (is_vertex) mesh_.vertices.push_back(p);
  }

  static bool isIndices(const Property& property) {
    return property.name == "vertex_indices" || property.name == "vertex_index";
  }

  /// Reads a list of numbers into `list_`.
  void readList(const Property& property) {
    const double count = body_.next(property.count);
    if (!(count >= 0 && count <= static_cast<double>(bytes_)))
      throw std::runtime_error("a list has more values than the file has bytes");
    list_.clear();
    while (static_cast<double>(list_.size()) < count) list_.push_back(body_.next(property.value));
  }

  static std::size_t vertexOf(double index) {
    if (!(index >= 0 && index < 0x1p53)) throw std::runtime_error("a corner names no vertex");
    return static_cast<std::size_t>(index);
  }

  void addFace() {
    for (const double index : list_) mesh_.corners.push_back(vertexOf(index));
    mesh_.endFace();
  }

  /// Adds triangle strips; a negative number ends a strip.
  void addStrips() {
    std::vector<std::size_t> strip;
    for (const double index : list_) {
      if (index >= 0) {
        strip.push_back(vertexOf(index));
      } else {
        mesh_.addTriangles(strip, PolygonMesh::Layout::Strip);
        strip.clear();
      }
    }
    mesh_.addTriangles(strip, PolygonMesh::Layout::Strip);
  }

  const PlyHeader header_;
  Body body_;
  const std::size_t bytes_;  ///< size of the file
  PolygonMesh mesh_;
  std::vector<double> list_;
};

}  // namespace

PolygonMesh readPly(std::string_view bytes) {
  return PlyReader(withoutByteOrderMark(bytes)).read();
}

}  // namespace adaptive_bvh
