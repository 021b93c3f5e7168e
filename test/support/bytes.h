#pragma once

#include <cstdint>
#include <string>

namespace adaptive_bvh_test {

/// Appends a number as this machine keeps it.
template <typename Number>
void put(std::string& bytes, Number x) {
  bytes.append(reinterpret_cast<const char*>(&x), sizeof(x));
}

/// A binary glTF file: its JSON text, filled up with spaces, and its buffer.
inline std::string glbOf(std::string json, const std::string& buffer) {
  std::string bytes = "glTF";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  put(bytes, std::uint32_t(2));
  put(bytes, std::uint32_t(12 + 8 + json.size() + 8 + buffer.size()));
  put(bytes, std::uint32_t(json.size()));
  bytes += "JSON" + json;
  put(bytes, std::uint32_t(buffer.size()));
  return bytes + std::string("BIN\0", 4) + buffer;
}

}  // namespace adaptive_bvh_test
