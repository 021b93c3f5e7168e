#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/bytes.h"

namespace adaptive_bvh_test {

/// How files of an archive are written: as they are, by the fixed Huffman code of Deflate, or by a
/// code of their own, with repetitions.
enum class Zipped { Stored, FixedCode, OwnCode };

/// Writes bits, the lowest of each byte first.
class BitWriter {
 public:
  void add(unsigned bits, unsigned count) {
    for (unsigned k = 0; k < count; ++k, ++count_) {
      if (count_ % 8 == 0) bytes += '\0';
      bytes.back() = char(std::uint8_t(bytes.back()) | ((bits >> k & 1u) << count_ % 8));
    }
  }
  /// A word of a Huffman code: its highest bit is first.
  void addWord(unsigned word, unsigned length) {
    for (unsigned k = length; k-- > 0;) add(word >> k & 1u, 1);
  }
  std::string bytes;

 private:
  unsigned count_ = 0;
};

/// With the fixed code: literals only, and a repetition of four bytes where the text repeats.
inline std::string deflateFixed(const std::string& text) {
  BitWriter out;
  out.add(1, 1);
  out.add(1, 2);
  const auto addSymbol = [&](unsigned symbol) {
    if (symbol < 144)
      out.addWord(0x30 + symbol, 8);
    else if (symbol < 256)
      out.addWord(0x190 + symbol - 144, 9);
    else
      out.addWord(symbol - 256, 7);
  };
  for (std::size_t i = 0; i < text.size();) {
    if (i >= 4 && text.compare(i, 4, text, i - 4, 4) == 0) {
      addSymbol(258);     // a length of 4
      out.addWord(3, 5);  // a distance of 4
      i += 4;
    } else {
      addSymbol(std::uint8_t(text[i++]));
    }
  }
  addSymbol(256);
  return out.bytes;
}

/// With a code of its own: 226 symbols by words of 8 bits, 60 by words of 9, distances by 1 bit.
inline std::string deflateOwn(const std::string& text) {
  BitWriter out;
  for (const auto& [bits, count] :
       std::vector<std::pair<unsigned, unsigned>>{{1, 1}, {2, 2}, {29, 5}, {1, 5}, {15, 4}})
    out.add(bits, count);
  // The code of lengths: 1, 8, 9 and the repetition 16, two bits each.
  for (const unsigned symbol : {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15})
    out.add(symbol == 1 || symbol == 8 || symbol == 9 || symbol == 16 ? 2 : 0, 3);
  const auto addLengths = [&out](unsigned word, unsigned count) {
    out.addWord(word, 2);
    for (--count; count >= 3;) {
      const unsigned repeated = count < 6 ? count : 6;
      out.addWord(3, 2);
      out.add(repeated - 3, 2);
      count -= repeated;
    }
    for (; count > 0; --count) out.addWord(word, 2);
  };
  addLengths(1, 226);
  addLengths(2, 60);
  addLengths(0, 2);  // of distances
  const auto addSymbol = [&out](unsigned symbol) {
    symbol < 226 ? out.addWord(symbol, 8) : out.addWord(226 + symbol, 9);
  };
  const auto repeats = [&text](std::size_t i) {  // the byte before, up to 258 times
    std::size_t count = 0;
    while (i > 0 && count < 258 && i + count < text.size() && text[i + count] == text[i - 1])
      ++count;
    return count;
  };
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t repeated = repeats(i);
    if (repeated == 258) {
      addSymbol(285);     // a length of 258
      out.addWord(0, 1);  // a distance of 1
      i += 258;
    } else if (repeated >= 3) {
      addSymbol(257);     // a length of 3
      out.addWord(0, 1);  // a distance of 1
      i += 3;
    } else {
      addSymbol(std::uint8_t(text[i++]));
    }
  }
  addSymbol(256);
  return out.bytes;
}

/// CRC-32 of a file in an archive.
inline std::uint32_t crc32Of(const std::string& bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char c : bytes) {
    crc ^= std::uint8_t(c);
    for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

/// An archive of files: their names and contents.
inline std::string zipOf(const std::vector<std::pair<std::string, std::string>>& files,
                         Zipped how) {
  std::string bytes, directory;
  for (const auto& [name, content] : files) {
    const std::string data = how == Zipped::Stored      ? content
                             : how == Zipped::FixedCode ? deflateFixed(content)
                                                        : deflateOwn(content);
    std::string common;  // of both headers
    for (const unsigned field : {20u, 0u, how == Zipped::Stored ? 0u : 8u, 0u, 0u})
      put(common, std::uint16_t(field));
    for (const std::size_t field : {std::size_t(crc32Of(content)), data.size(), content.size()})
      put(common, std::uint32_t(field));
    put(common, std::uint16_t(name.size()));
    put(common, std::uint16_t(0));
    directory += std::string("PK\1\2\24\0", 6) + common + std::string(10, '\0');
    put(directory, std::uint32_t(bytes.size()));
    directory += name;
    bytes += "PK\3\4" + common + name + data;
  }
  std::string end = std::string("PK\5\6\0\0\0\0", 8);
  for (int k = 0; k < 2; ++k) put(end, std::uint16_t(files.size()));
  put(end, std::uint32_t(directory.size()));
  put(end, std::uint32_t(bytes.size()));
  put(end, std::uint16_t(0));
  return bytes + directory + end;
}

}  // namespace adaptive_bvh_test
