#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace adaptive_bvh {

struct BinaryType {
  char kind = 0;  ///< 'i' signed, 'u' unsigned, 'f' floating; 0: no type
  std::size_t bytes = 0;
};

template <typename Number, typename Bits>
double asFloating(Bits bits) {
  Number number;
  static_assert(sizeof(number) == sizeof(bits), "the same bits");
  std::memcpy(&number, &bits, sizeof(number));
  return static_cast<double>(number);
}

/// The number at a place of a file; all its bytes must be there.
inline double numberAt(std::string_view file, std::size_t at, BinaryType type,
                       bool is_big_endian = false) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < type.bytes; ++k)
    bits =
        bits << 8 | static_cast<unsigned char>(file[at + (is_big_endian ? k : type.bytes - 1 - k)]);
  if (type.kind == 'f' && type.bytes == 8) return asFloating<double>(bits);
  if (type.kind == 'f') return asFloating<float>(static_cast<std::uint32_t>(bits));
  const auto number = static_cast<double>(bits);
  const int digits = 8 * static_cast<int>(type.bytes);
  const bool is_negative = type.kind == 'i' && bits >> (digits - 1) != 0;
  return is_negative ? number - std::ldexp(1., digits) : number;
}

/// Four bytes, little-endian.
inline std::size_t wordAt(std::string_view file, std::size_t at) {
  return static_cast<std::size_t>(numberAt(file, at, {'u', 4}));
}

}  // namespace adaptive_bvh
