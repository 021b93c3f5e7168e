#include <sstream>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

/// By its length, whatever its first word.
bool isBinary(const std::string& bytes) {
  constexpr std::size_t kHeader = 84, kFacet = 50;
  return bytes.size() >= kHeader && (bytes.size() - kHeader) % kFacet == 0 &&
         (bytes.size() - kHeader) / kFacet == wordAt(bytes, kHeader - 4);
}

bool readPoint(std::istream& words) {
  std::string x, y, z;
  return words >> x >> y >> z && isNumber(x) && isNumber(y) && isNumber(z);
}

}  // namespace

/// Facets of three vertices each, from the first word to the last.
std::string findStlError(const std::string& text) {
  if (isBinary(text)) return "";
  std::istringstream words(text);
  std::string word, name;
  int corners = -1;  // of the facet that is open
  bool is_solid_open = false;
  while (words >> word) {
    if (word == "solid") {
      std::getline(words, name);
      is_solid_open = true;
    } else if (word == "facet") {
      if (corners >= 0 || !(words >> word) || !readPoint(words))  // "normal" and its numbers
        return "a facet begins within another, or without a normal";
      corners = 0;
    } else if (word == "vertex") {
      if (corners < 0 || ++corners > 3 || !readPoint(words))
        return "a vertex is out of place, or not three numbers";
    } else if (word == "endfacet") {
      if (corners != 3) return "a facet does not have three vertices";
      corners = -1;
    } else if (word == "endsolid") {
      std::getline(words, name);
      is_solid_open = false;
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      return "there is an unknown word in it";
    }
  }
  return corners >= 0 || is_solid_open ? "it ends within a solid" : "";
}

}  // namespace adaptive_bvh
