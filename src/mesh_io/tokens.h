#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "printable.h"

// Reads words, lines and numbers from the bytes of a file.
namespace adaptive_bvh {

inline bool isSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
inline bool isLineEnd(char c) { return c == '\n' || c == '\r'; }

/// Converts ASCII letters to lower case, independent of the locale.
inline std::string inLowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

/// The text without the byte order mark that some programs write.
inline std::string_view withoutByteOrderMark(std::string_view text) {
  return text.substr(text.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0);
}

/// Parses a whole word as a number, in any locale; nothing if it is not a number or out of range.
template <typename Number>
std::optional<Number> parse(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  Number number = 0;
  const char* const end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data(), end, number);
  if (word.empty() || rest != end || error != std::errc()) return std::nullopt;
  return number;
}

/// Parses a double; accepts "nan" and "inf". Numbers that are out of its range, but not out of that
/// of a long double, become infinite or 0.
inline std::optional<double> numberOf(std::string_view word) {
  if (const std::optional<double> number = parse<double>(word)) return number;
  if (const std::optional<long double> number = parse<long double>(word))
    return static_cast<double>(*number);
  return std::nullopt;
}

inline std::optional<std::int64_t> integerOf(std::string_view word) {
  return parse<std::int64_t>(word);
}

/// The shortest text that parses as the same number: "65535" and not "65535.000000".
inline std::string textOf(double number) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof(text), number).ptr};
}

/// Reads a text by words or lines, from a position on. Keeps a view of the text.
class Words {
 public:
  explicit Words(std::string_view text, std::size_t position = 0)
      : text_(text), position_(position) {}

  /// The next word; empty at the end.
  std::string_view next() {
    while (position_ < text_.size() && isSpace(text_[position_])) ++position_;
    const std::size_t begin = position_;
    while (position_ < text_.size() && !isSpace(text_[position_])) ++position_;
    return text_.substr(begin, position_ - begin);
  }

  /// The rest of the line; line ends are "\n", "\r\n" and "\r".
  std::string_view restOfLine() {
    const std::size_t begin = position_;
    position_ = std::min(text_.find_first_of("\r\n", position_), text_.size());
    const std::string_view line = text_.substr(begin, position_ - begin);
    position_ =
        std::min(position_ + (text_.compare(position_, 2, "\r\n") == 0 ? 2 : 1), text_.size());
    return line;
  }

  /// The next word as a number. Throws std::runtime_error if it is not a number.
  double number() {
    const std::string_view word = next();
    if (const std::optional<double> number = numberOf(word)) return *number;
    fail(quote(word) + " is no number");
  }

  bool isAtEnd() const { return position_ >= text_.size(); }
  std::size_t position() const { return position_; }

  /// Throws std::runtime_error with the current line number.
  [[noreturn]] void fail(const std::string& reason) const {
    const std::string_view before = text_.substr(0, position_);
    std::size_t line = 1;
    for (std::size_t i = 0; i + 1 < before.size(); ++i)  // a line end that was just read counts to
                                                         // its own line
      line += before[i] == '\n' || (before[i] == '\r' && before[i + 1] != '\n');
    throw std::runtime_error("line " + std::to_string(line) + ": " + reason);
  }

 private:
  std::string_view text_;
  std::size_t position_ = 0;
};

/// Parses a number of things, of which each takes at least one byte. Throws std::runtime_error if
/// it is not a count, or more than the bytes of the file.
inline std::size_t countOf(const std::string& things, std::string_view count, std::size_t bytes) {
  const std::optional<std::int64_t> number = integerOf(count);
  if (number && *number >= 0 && static_cast<std::uint64_t>(*number) <= bytes)
    return static_cast<std::size_t>(*number);
  throw std::runtime_error("it announces " + quote(count) + " " + things + ", and has " +
                           std::to_string(bytes) + " bytes");
}

/// The type of a number in a binary file.
struct BinaryType {
  char kind = 0;  ///< 'i' signed, 'u' unsigned, 'f' floating; 0: no type
  std::size_t bytes = 0;
};

/// The floating-point number with these bits.
template <typename Number, typename Bits>
double asFloating(Bits bits) {
  Number number;
  static_assert(sizeof(number) == sizeof(bits), "the same bits");
  std::memcpy(&number, &bits, sizeof(number));
  return static_cast<double>(number);
}

/// The number at a position of a file; all its bytes must exist. Integers have at most four bytes.
inline double numberAt(std::string_view file, std::size_t position, BinaryType type,
                       bool is_big_endian = false) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < type.bytes; ++k) {
    const std::size_t byte = position + (is_big_endian ? k : type.bytes - 1 - k);
    bits = bits << 8 | static_cast<unsigned char>(file[byte]);
  }
  if (type.kind == 'f' && type.bytes == 8) return asFloating<double>(bits);
  if (type.kind == 'f') return asFloating<float>(static_cast<std::uint32_t>(bits));
  const auto number = static_cast<double>(bits);
  const int digits = 8 * static_cast<int>(type.bytes);
  const bool is_negative = type.kind == 'i' && bits >> (digits - 1) != 0;
  return is_negative ? number - std::ldexp(1., digits) : number;
}

/// Four bytes as a little-endian integer.
inline std::size_t wordAt(std::string_view file, std::size_t position) {
  return static_cast<std::size_t>(numberAt(file, position, {'u', 4}));
}

}  // namespace adaptive_bvh
