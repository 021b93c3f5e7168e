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

inline std::string base64(const std::string& bytes) {
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? std::uint8_t(bytes[i + k]) : 0u);
    for (int k = 0; k < 4; ++k)
      text += i + std::size_t(k) > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63];
  }
  return text;
}

}  // namespace adaptive_bvh_test
