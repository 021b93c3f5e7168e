// Makes any bytes printable, for messages that quote a file.
#include "printable.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

/// The length of the first UTF-8 character of a text; 0 if it is invalid or not printable.
std::size_t lengthOfCharacter(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  if (first < 0xC0 || first >= 0xF8) return 0;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  unsigned code = first & 0x7Fu >> length;  // bits of the first byte after its length
  for (std::size_t k = 1; k < length; ++k) {
    if (byte(k) >> 6 != 2) return 0;
    code = code << 6 | (byte(k) & 0x3F);
  }
  constexpr unsigned kLeast[] = {0x80, 0x800, 0x10000};  // smaller codes must be shorter
  const bool is_surrogate = code >> 11 == 0x1B;
  return code < kLeast[length - 2] || code > 0x10FFFF || is_surrogate ? 0 : length;
}

}  // namespace

std::string printable(std::string_view text) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = lengthOfCharacter(text.substr(at));
    const auto byte = static_cast<unsigned char>(text[at]);
    if (length == 0)
      result.append("\\x").append({kDigits[byte >> 4], kDigits[byte & 15]});
    else
      result.append(text, at, length);
    at += std::max<std::size_t>(length, 1);
  }
  return result;
}

std::string quote(std::string_view word) { return "'" + printable(word.substr(0, 40)) + "'"; }

}  // namespace adaptive_bvh
