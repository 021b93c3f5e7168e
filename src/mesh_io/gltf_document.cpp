// Reads a glTF document: its JSON text, which a binary file contains together with a buffer.
#include "gltf_document.h"

#include <stdexcept>

#include "strict_json.h"

namespace adaptive_bvh {
namespace {

/// Whether an extension does not affect positions.
bool isHarmless(const std::string& extension) {
  for (const char* prefix :
       {"KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_xmp",
        "EXT_texture_", "EXT_lights_", "MSFT_texture_", "KHR_binary_glTF"})
    if (extension.rfind(prefix, 0) == 0) return true;
  return false;
}

/// The JSON text of a file (number 0), or the buffer after it (1). A binary file has a header of
/// three words, then chunks, each after its length and its type. Version 1 has a single chunk.
std::string_view chunkOf(std::string_view bytes, std::size_t number) {
  if (bytes.substr(0, 4) != "glTF") return bytes.substr(number == 0 ? 0 : bytes.size());
  if (bytes.size() < 20) throw std::runtime_error("its header does not end");
  std::size_t at = 12;
  for (std::size_t chunk = 0; bytes.size() >= at + 8; ++chunk) {
    const std::size_t length = wordAt(bytes, at);
    at += 8;
    if (length > bytes.size() - at)
      throw std::runtime_error("it announces a chunk of " + std::to_string(length) +
                               " bytes, and has " + std::to_string(bytes.size() - at));
    if (chunk == number) return bytes.substr(at, length);
    at += length;
    if (wordAt(bytes, 4) == 1) return bytes.substr(at);
  }
  return "";
}

}  // namespace

GltfDocument::GltfDocument(const std::string& bytes, NamedFiles files)
    : json(parseStrictly(std::string(chunkOf(bytes, 0)))),
      accessors(json, GltfBuffers(std::string(chunkOf(bytes, 1)), std::move(files)), bytes.size()) {
  for (const Json& extension : at(json, "extensionsRequired"))
    if (extension.is_string() && !isHarmless(extension.get<std::string>()))
      throw std::runtime_error("it requires the extension " + extension.get<std::string>() +
                               ", which is not read");
}

}  // namespace adaptive_bvh
