#include "format_check.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <sstream>

#include "formats.h"

namespace adaptive_bvh {
namespace {

using FormatCheck = std::string (*)(const std::string& text);

std::string inLowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// In lower case, without the dot.
std::string extensionOf(const std::string& path) {
  return inLowerCase(path.substr(path.find_last_of('.') + 1));
}

/// Whether the first word is OFF, behind letters for what its vertices have, and behind comments.
bool beginsAsOff(const std::string& text) {
  std::istringstream words(text);
  std::string word;
  while (words >> word && word[0] == '#') std::getline(words, word);
  return word.compare(std::min(word.find_first_not_of("STCN4n"), word.size()), 3, "OFF") == 0;
}

/// By the beginning of the file and its name; null where the format is not checked.
FormatCheck checkFor(const std::string& path, const std::string& beginning) {
  const std::string extension = extensionOf(path);
  const std::string keyword = beginning.substr(0, beginning.find_first_of(" \t\r\n"));
  const std::string magic = inLowerCase(beginning.substr(0, 3));
  if (beginning.compare(0, 4, "glTF") == 0) return findGlbError;
  if (extension == "gltf") return findGltfError;
  if (extension == "dae") return findXmlError;
  if (magic == "ply") return findPlyError;
  if (extension == "off" || beginsAsOff(beginning)) return findOffError;
  if (keyword == "solid") return findStlError;
  const std::size_t first = beginning.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  const bool is_tag = first != beginning.npos && beginning[first] == '<';
  return is_tag || beginning.find("<COLLADA") != beginning.npos ? findXmlError : nullptr;
}

}  // namespace

std::string findFormatError(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(4096, '\0');
  file.read(&text[0], static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));

  const FormatCheck check = checkFor(path, text);
  if (!check) return "";
  text.append(std::istreambuf_iterator<char>(file), {});
  return check(text);
}

}  // namespace adaptive_bvh
