// Reads OFF: a header, then vertices and polygonal faces, one per line.
#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

/// Reads the next line with words, without comments; returns false at the end.
bool nextLine(Words& text, std::string_view& line) {
  while (!text.isAtEnd()) {
    line = text.restOfLine();
    line = line.substr(0, line.find('#'));
    if (!Words(line).next().empty()) return true;
  }
  return false;
}

/// Reads the words of a header, which may be spread over several lines.
class Header {
 public:
  explicit Header(Words& text) : text_(text) {}

  std::string_view next() {
    std::string_view word = line_.next(), line;
    while (word.empty() && nextLine(text_, line)) word = (line_ = Words(line)).next();
    return word;
  }
  /// Skips the number of edges, which may be missing, or alone on a line.
  void skipEdges() {
    Words after_next_line = text_;
    std::string_view line;
    if (!line_.next().empty() || !nextLine(after_next_line, line)) return;
    Words words(line);
    words.next();
    if (words.next().empty()) text_ = after_next_line;
  }

 private:
  Words& text_;
  Words line_{""};  ///< the rest of the current line
};

/// The letters before OFF, which announce additional vertex data; 4 means four coordinates. Throws
/// for other first words, and for "nOFF" (other dimensions).
std::string prefixOf(std::string_view keyword) {
  const std::size_t off = keyword.find("OFF");
  if (off == keyword.npos || off + 3 != keyword.size() ||
      keyword.find_first_not_of("STCN4") != off + (keyword[off] == 'O' ? 0 : 1))
    throw std::runtime_error(quote(keyword) + " is no first word of OFF that is read");
  return std::string(keyword.substr(0, off));
}

/// The vertex in a line. `text` is used for messages.
fcl::Vector3d readVertex(std::string_view line, bool is_homogeneous, const Words& text) {
  Words words(line);
  Eigen::Vector4d p(0, 0, 0, 1);
  for (int k = 0; k < (is_homogeneous ? 4 : 3); ++k) {
    const auto number = numberOf(words.next());
    if (!number) text.fail("a vertex has not enough numbers");
    p[k] = *number;
  }
  return p.hnormalized();
}

void readFace(std::string_view line, const Words& text, PolygonMesh& mesh) {
  Words words(line);
  const auto corners = integerOf(words.next());
  if (!corners || *corners < 0) text.fail("a face does not begin with the number of its corners");
  for (std::int64_t k = 0; k < *corners; ++k) {
    const auto vertex = integerOf(words.next());
    if (!vertex || *vertex < 0) text.fail("a face has not as many corners as it announces");
    mesh.corners.push_back(static_cast<std::size_t>(*vertex));
  }
  mesh.endFace();
}

}  // namespace

PolygonMesh readOff(std::string_view bytes) {
  Words text(withoutByteOrderMark(bytes));
  Header header(text);
  const bool is_homogeneous = prefixOf(header.next()).find('4') != std::string::npos;
  const std::size_t vertices = countOf("vertices", header.next(), bytes.size()),
                    faces = countOf("faces", header.next(), bytes.size());
  header.skipEdges();

  PolygonMesh mesh;
  for (std::string_view line; mesh.sizes.size() < faces;) {
    if (!nextLine(text, line)) text.fail("it has fewer vertices or faces than it announces");
    if (mesh.vertices.size() < vertices)
      mesh.vertices.push_back(readVertex(line, is_homogeneous, text));
    else
      readFace(line, text, mesh);
  }
  return mesh;
}

}  // namespace adaptive_bvh
