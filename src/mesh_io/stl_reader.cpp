// Reads STL: tells binary files from text by their length and by zero bytes.
#include <string>
#include <string_view>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

// A binary file has 80 arbitrary bytes and the number of facets, then the facets. A facet has the
// normal and three corners, of three floats each, and an attribute count of two bytes.
constexpr std::size_t kHeader = 84, kFacet = 50;
constexpr BinaryType kFloat = {'f', 4};

bool hasLengthWithoutPayloads(std::string_view bytes) {
  return bytes.size() > kHeader && bytes.size() - kHeader == kFacet * wordAt(bytes, kHeader - 4);
}

/// The number of bytes of the payload of the facet at this position: its attribute count. Most
/// programs write 0 or a colour there.
std::size_t payloadOf(std::string_view bytes, std::size_t facet) {
  return static_cast<std::size_t>(numberAt(bytes, facet + kFacet - 2, {'u', 2}));
}

/// The end of the last payload, read as such; greater than the file size if none can be.
std::size_t endOfPayloads(std::string_view bytes) {
  const std::size_t facets = wordAt(bytes, kHeader - 4);
  std::size_t position = kHeader;
  for (std::size_t f = 0; f < facets; ++f) {
    if (position + kFacet > bytes.size()) return bytes.size() + 1;
    position += kFacet + payloadOf(bytes, position);
  }
  return position;
}

/// Whether facets have payloads. Throws if attribute counts could be payloads or colours.
bool hasPayloads(std::string_view bytes, std::size_t facets) {
  const std::size_t end = endOfPayloads(bytes);
  if (hasLengthWithoutPayloads(bytes) || end == kHeader + kFacet * facets || end > bytes.size())
    return false;
  if (end == bytes.size()) return true;
  throw std::runtime_error("its attribute counts announce a length of " + std::to_string(end) +
                           " bytes, its triangles one of " +
                           std::to_string(kHeader + kFacet * facets) + ", and it has " +
                           std::to_string(bytes.size()));
}

/// Whether the file is binary: by its length, whatever its first word is, or by a zero byte.
bool isBinary(std::string_view bytes) {
  if (bytes.size() < kHeader) return false;
  return hasLengthOfBinaryStl(bytes) || bytes.find('\0') != bytes.npos ||
         inLowerCase(Words(withoutByteOrderMark(bytes)).next()) != "solid";
}

PolygonMesh readBinary(std::string_view bytes) {
  const std::size_t facets = wordAt(bytes, kHeader - 4),
                    most_facets = (bytes.size() - kHeader) / kFacet;
  if (facets > most_facets)
    throw std::runtime_error("it announces " + std::to_string(facets) +
                             " triangles, and has bytes for " + std::to_string(most_facets));
  const bool has_payloads = hasPayloads(bytes, facets);
  PolygonMesh mesh;
  std::size_t position = kHeader;
  for (std::size_t f = 0; f < facets; ++f) {
    for (std::size_t k = 1; k <= 3; ++k) {  // the normal is number 0
      const std::size_t corner = position + 12 * k;
      mesh.vertices.emplace_back(numberAt(bytes, corner, kFloat),
                                 numberAt(bytes, corner + 4, kFloat),
                                 numberAt(bytes, corner + 8, kFloat));
    }
    mesh.addTriangle(3 * f, 3 * f + 1, 3 * f + 2);
    position += kFacet + (has_payloads ? payloadOf(bytes, position) : 0);
  }
  return mesh;
}

fcl::Vector3d readPoint(Words& words) {
  fcl::Vector3d p;
  for (double& x : p) x = words.number();
  return p;
}

PolygonMesh readText(std::string_view text) {
  PolygonMesh mesh;
  Words words(withoutByteOrderMark(text));
  bool is_facet_open = false;
  for (std::string word; !(word = inLowerCase(words.next())).empty();) {
    if (word == "solid" || word == "endsolid") {
      if (is_facet_open) words.fail("a solid ends within a facet");
      words.restOfLine();  // skips the name
    } else if (word == "facet") {
      if (is_facet_open || inLowerCase(words.next()) != "normal")
        words.fail("a facet begins within another, or without a normal");
      readPoint(words);
      is_facet_open = true;
    } else if (word == "vertex") {
      if (!is_facet_open) words.fail("a vertex is not in a facet");
      mesh.corners.push_back(mesh.vertices.size());
      mesh.vertices.push_back(readPoint(words));
    } else if (word == "endfacet") {
      mesh.endFace();
      if (!is_facet_open || mesh.sizes.back() != 3)
        words.fail("a facet does not have three vertices");
      is_facet_open = false;
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      words.fail(quote(word) + " is no word of STL");
    }
  }
  if (is_facet_open) words.fail("it ends within a facet");
  return mesh;
}

}  // namespace

bool hasLengthOfBinaryStl(std::string_view bytes) {
  return hasLengthWithoutPayloads(bytes) ||
         (bytes.size() > kHeader && endOfPayloads(bytes) == bytes.size());
}

PolygonMesh readStl(std::string_view bytes) {
  return isBinary(bytes) ? readBinary(bytes) : readText(bytes);
}

}  // namespace adaptive_bvh
