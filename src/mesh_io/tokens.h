#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace adaptive_bvh {

/// As assimp sees it: no vertical tabs or form feeds.
inline bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// Whether the whole word is one; "nan" and "inf" are.
inline bool isNumber(const std::string& word) {
  char* end = nullptr;
  std::strtod(word.c_str(), &end);
  return !word.empty() && *end == '\0';
}

/// A count as written; larger than any file when it is not one.
inline std::uintmax_t countOf(const std::string& text) {
  if (text.empty() || text.size() > 18 || text.find_first_not_of("0123456789") != text.npos)
    return UINTMAX_MAX;
  return std::stoull(text);
}

/// Four bytes, little-endian.
inline std::uint32_t wordAt(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t k = 4; k-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[at + k]);
  return word;
}

/// What is wrong with a count of things in a file of so many bytes: each takes a byte at least.
inline std::string findCountError(const std::string& things, const std::string& count,
                                  std::size_t bytes) {
  if (countOf(count) <= bytes) return "";
  return "it announces '" + count + "' " + things + ", and has " + std::to_string(bytes) + " bytes";
}

}  // namespace adaptive_bvh
