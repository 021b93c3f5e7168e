#include "format_check.h"

#include <cctype>
#include <fstream>
#include <iterator>

#include "formats.h"

namespace adaptive_bvh {
namespace {

using FormatCheck = std::string (*)(const std::string& text);

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// In lower case, without the dot.
std::string extensionOf(const std::string& path) {
  std::string extension = path.substr(path.find_last_of('.') + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// By the beginning of the file and its name; null where the format is not checked.
FormatCheck checkFor(const std::string& path, const std::string& beginning) {
  const std::string extension = extensionOf(path);
  const std::string keyword = beginning.substr(0, beginning.find_first_of(" \t\r\n"));
  if (beginning.compare(0, 4, "glTF") == 0) return findGlbError;
  if (extension == "gltf") return findGltfError;
  if (extension == "dae") return findXmlError;
  if (keyword == "ply" || keyword == "PLY") return findPlyError;
  if (endsWith(keyword, "OFF")) return findOffError;
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
