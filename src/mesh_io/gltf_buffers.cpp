// Reads the buffers of a glTF document by their URIs.
#include "gltf_buffers.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <stdexcept>

namespace adaptive_bvh {
namespace {

std::string fromBase64(std::string_view text) {
  std::string bytes;
  std::uint32_t group = 0;  // bits that are read; the lowest `bits` of them are not yet written
  int bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const std::size_t digit =
        std::string_view("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/")
            .find(c);
    if (digit == std::string_view::npos) throw std::runtime_error("a buffer is not in base64");
    group = group << 6 | static_cast<std::uint32_t>(digit);
    if ((bits += 6) < 8) continue;
    bytes += static_cast<char>(group >> (bits -= 8) & 0xFF);
  }
  return bytes;
}

/// Decodes a file name in a URI: "%20" is a space.
std::string fromUri(const std::string& uri) {
  std::string name;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned code = 0;
    const char* const end = uri.data() + std::min(i + 3, uri.size());
    if (uri[i] == '%' &&
        std::from_chars(uri.data() + i + 1, end, code, 16).ptr == uri.data() + i + 3) {
      name += static_cast<char>(code);
      i += 2;
    } else {
      name += uri[i];
    }
  }
  return name;
}

}  // namespace

std::string_view GltfBuffers::bytesOf(const Json& buffer) {
  const auto [found, is_new] = buffers_.try_emplace(&buffer);
  if (is_new) found->second = read(textAt(buffer, "uri"));
  return found->second;
}

/// The bytes that a URI refers to; without a URI, the embedded buffer.
std::string_view GltfBuffers::read(const std::string& uri) {
  if (uri.empty() || uri == "data:,") return chunk_;
  if (uri.rfind("data:", 0) != 0) return files_.read(fromUri(uri));
  const std::size_t comma = std::min(uri.find(','), uri.size() - 1);
  return decoded_.emplace_back(fromBase64(std::string_view(uri).substr(comma + 1)));
}

}  // namespace adaptive_bvh
