#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

constexpr std::size_t kHeader = 84, kFacet = 50;
constexpr BinaryType kFloat = {'f', 4};

/// By its length, whatever its first word; or because there is a zero in it, which no text has.
bool isBinary(const std::string& bytes) {
  if (bytes.size() < kHeader) return false;
  return hasLengthOfBinaryStl(bytes) || bytes.find('\0') != bytes.npos ||
         inLowerCase(Words(bytes).next()) != "solid";
}

PolygonMesh readBinary(const std::string& bytes) {
  const std::size_t facets = wordAt(bytes, kHeader - 4), room = (bytes.size() - kHeader) / kFacet;
  if (facets > room)
    throw std::runtime_error("it announces " + std::to_string(facets) +
                             " triangles, and has bytes for " + std::to_string(room));
  PolygonMesh mesh;
  for (std::size_t f = 0; f < facets; ++f) {
    for (std::size_t k = 1; k <= 3; ++k) {  // after the normal
      const std::size_t at = kHeader + kFacet * f + 12 * k;
      mesh.vertices.emplace_back(numberAt(bytes, at, kFloat), numberAt(bytes, at + 4, kFloat),
                                 numberAt(bytes, at + 8, kFloat));
    }
    mesh.addTriangle(3 * f, 3 * f + 1, 3 * f + 2);
  }
  return mesh;
}

fcl::Vector3d readPoint(Words& words) {
  fcl::Vector3d p;
  for (double& x : p) x = words.number();
  return p;
}

/// Facets of three vertices each, from the first word to the last.
PolygonMesh readText(const std::string& text) {
  PolygonMesh mesh;
  Words words(text);
  bool is_facet_open = false;
  for (std::string word; !(word = inLowerCase(words.next())).empty();) {
    if (word == "solid" || word == "endsolid") {
      if (is_facet_open) words.fail("a solid ends within a facet");
      words.restOfLine();  // its name
    } else if (word == "facet") {
      if (is_facet_open || inLowerCase(words.next()) != "normal")
        words.fail("a facet begins within another, or without a normal");
      readPoint(words);
      is_facet_open = true;
    } else if (word == "vertex") {
      if (!is_facet_open) words.fail("a vertex is out of place");
      mesh.corners.push_back(mesh.vertices.size());
      mesh.vertices.push_back(readPoint(words));
    } else if (word == "endfacet") {
      mesh.endFace();
      if (!is_facet_open || mesh.sizes.back() != 3)
        words.fail("a facet does not have three vertices");
      is_facet_open = false;
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      words.fail("'" + word.substr(0, 40) + "' is no word of STL");
    }
  }
  if (is_facet_open) words.fail("it ends within a facet");
  return mesh;
}

}  // namespace

bool hasLengthOfBinaryStl(const std::string& bytes) {
  return bytes.size() > kHeader && bytes.size() - kHeader == kFacet * wordAt(bytes, kHeader - 4);
}

PolygonMesh readStl(const std::string& bytes) {
  return isBinary(bytes) ? readBinary(bytes) : readText(bytes);
}

}  // namespace adaptive_bvh
