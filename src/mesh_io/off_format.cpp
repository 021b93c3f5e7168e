#include <sstream>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {

std::string findOffError(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);  // the keyword
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string vertices, faces;
    if (!(words >> vertices) || vertices[0] == '#') continue;
    words >> faces;
    const std::string error = findCountError("vertices", vertices, text.size());
    return !error.empty() ? error : findCountError("faces", faces, text.size());
  }
  return "";
}

}  // namespace adaptive_bvh
