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

}  // namespace

GltfDocument::GltfDocument(const std::string& bytes, NamedFiles files)
    : GltfDocument(partsOf(bytes), std::move(files), bytes.size()) {}

GltfDocument::GltfDocument(Parts parts, NamedFiles files, std::size_t bytes)
    : json(parseStrictly(parts.json)),
      accessors(json, GltfBuffers(std::move(parts.chunk), std::move(files)), bytes) {
  for (const Json& extension : at(json, "extensionsRequired"))
    if (extension.is_string() && !isHarmless(extension.get<std::string>()))
      throw std::runtime_error("it requires the extension " + extension.get<std::string>() +
                               ", which is not read");
}

// A binary file has a header of three words, then chunks of JSON and of bytes, each after its
// length and its type. Version 1 is read as a single chunk of JSON, and bytes.
GltfDocument::Parts GltfDocument::partsOf(const std::string& bytes) {
  if (bytes.compare(0, 4, "glTF") != 0) return {bytes, ""};
  if (bytes.size() < 20) throw std::runtime_error("its header does not end");
  const bool is_old = wordAt(bytes, 4) == 1;
  std::string parts[2];
  std::size_t at = 12;
  for (std::string& part : parts) {
    if (bytes.size() < at + 8) break;
    const std::size_t length = wordAt(bytes, at);
    at += 8;
    if (length > bytes.size() - at)
      throw std::runtime_error("it announces a chunk of " + std::to_string(length) +
                               " bytes, and has " + std::to_string(bytes.size() - at));
    part = bytes.substr(at, length);
    at += length;
    if (is_old) {
      parts[1] = bytes.substr(at);
      break;
    }
  }
  return {std::move(parts[0]), std::move(parts[1])};
}

}  // namespace adaptive_bvh
