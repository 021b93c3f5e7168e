// Reads ZIP archives: their directory, and files compressed by Deflate (RFC 1951).
#include "zip.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>

#include "tokens.h"

namespace adaptive_bvh {
namespace {

[[noreturn]] void failBroken() { throw std::runtime_error("its ZIP archive is broken"); }

/// A little-endian number at a position of an archive.
std::size_t fieldAt(std::string_view archive, std::size_t at, std::size_t bytes) {
  if (at > archive.size() || bytes > archive.size() - at) failBroken();
  return static_cast<std::size_t>(numberAt(archive, at, {'u', bytes}));
}

/// Reads the bits of a Deflate stream (RFC 1951), the lowest bit of each byte first.
class Bits {
 public:
  explicit Bits(std::string_view bytes) : bytes_(bytes) {}

  /// The number in the next `count` bits.
  unsigned next(unsigned count) {
    unsigned bits = 0;
    for (unsigned k = 0; k < count; ++k, ++position_) {
      if (position_ / 8 >= bytes_.size()) failBroken();
      bits |= (static_cast<unsigned char>(bytes_[position_ / 8]) >> position_ % 8 & 1u) << k;
    }
    return bits;
  }
  void skipToByte() { position_ = (position_ + 7) / 8 * 8; }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;  ///< in bits
};

/// A Huffman code: its symbols sorted by the lengths of their code words. Like zlib, refuses codes
/// with too many or too few words, except for a code with a single word.
class HuffmanCode {
 public:
  /// `lengths` are those of the code words, by symbol; 0 for symbols without a word.
  explicit HuffmanCode(const std::vector<unsigned>& lengths) {
    for (unsigned length = 1; length <= kLongest; ++length)
      for (unsigned symbol = 0; symbol < lengths.size(); ++symbol)
        if (lengths[symbol] == length) {
          symbols_.push_back(symbol);
          ++counts_[length];
        }
    int free = 1;  // number of words of this length that no shorter word begins
    for (unsigned length = 1; length <= kLongest; ++length)
      if ((free = 2 * free - static_cast<int>(counts_[length])) < 0) failBroken();
    if (free > 0 && symbols_.size() > counts_[1]) failBroken();
  }

  /// Reads a code word; returns its symbol.
  unsigned read(Bits& bits) const {
    unsigned word = 0, first = 0, index = 0;  // first word of this length, and where it is sorted
    for (unsigned length = 1; length <= kLongest; ++length) {
      word = word << 1 | bits.next(1);
      if (word < first + counts_[length]) return symbols_[index + word - first];  // word >= first
      index += counts_[length];
      first = (first + counts_[length]) << 1;
    }
    failBroken();
  }

 private:
  static constexpr unsigned kLongest = 15;
  std::vector<unsigned> symbols_;                ///< sorted by length, then by number
  std::array<unsigned, kLongest + 1> counts_{};  ///< number of words, by length
};

/// The codes of literals and lengths, and of distances.
using Codes = std::array<HuffmanCode, 2>;

Codes fixedCodes() {
  std::vector<unsigned> lengths(288, 8);
  std::fill(lengths.begin() + 144, lengths.begin() + 256, 9);
  std::fill(lengths.begin() + 256, lengths.begin() + 280, 7);
  return {HuffmanCode(lengths), HuffmanCode(std::vector<unsigned>(32, 5))};
}

/// Reads the codes of a block, given by the lengths of their words, which are Huffman-coded too.
Codes readCodes(Bits& bits) {
  const unsigned literals = bits.next(5) + 257, distances = bits.next(5) + 1;
  const unsigned code_lengths = bits.next(4) + 4;
  std::vector<unsigned> lengths(19);
  constexpr unsigned kOrder[] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
  for (unsigned k = 0; k < code_lengths; ++k) lengths[kOrder[k]] = bits.next(3);
  const HuffmanCode code(lengths);
  lengths.clear();
  while (lengths.size() < literals + distances) {
    const unsigned symbol = code.read(bits);
    if (symbol < 16) {
      lengths.push_back(symbol);
      continue;
    }
    if (symbol == 16 && lengths.empty()) failBroken();
    const unsigned repeated = symbol == 16 ? lengths.back() : 0;
    const unsigned count = symbol == 16   ? 3 + bits.next(2)
                           : symbol == 17 ? 3 + bits.next(3)
                                          : 11 + bits.next(7);
    lengths.insert(lengths.end(), count, repeated);
  }
  if (lengths.size() > literals + distances || literals > 286 || distances > 30 ||
      lengths[256] == 0)
    failBroken();
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(literals);
  return {HuffmanCode({lengths.begin(), middle}), HuffmanCode({middle, lengths.end()})};
}

/// Reads the extra bits of a symbol that stands for a length (`least` is 3) or a distance (1).
/// Returns the length or distance. Each group of `group` symbols has one more extra bit.
unsigned readExtended(Bits& bits, unsigned symbol, unsigned group, unsigned least) {
  if (symbol < 2 * group) return least + symbol;
  const unsigned extra = symbol / group - 1;
  return least + ((group + symbol % group) << extra) + bits.next(extra);
}

/// Appends the text of a compressed block, until it is longer than `size`.
void readCompressed(Bits& bits, const Codes& codes, std::size_t size, std::string& text) {
  while (text.size() <= size) {
    const unsigned symbol = codes[0].read(bits);
    if (symbol == 256) return;
    if (symbol < 256) {
      text += static_cast<char>(symbol);
      continue;
    }
    if (symbol > 285) failBroken();
    const unsigned length = symbol == 285 ? 258 : readExtended(bits, symbol - 257, 4, 3);
    const unsigned distance_symbol = codes[1].read(bits);
    if (distance_symbol > 29) failBroken();
    const unsigned distance = readExtended(bits, distance_symbol, 2, 1);
    if (distance > text.size()) failBroken();
    for (unsigned k = 0; k < length; ++k) text += text[text.size() - distance];
  }
}

/// Appends the text of an uncompressed block.
void readStored(Bits& bits, std::string& text) {
  bits.skipToByte();
  const unsigned length = bits.next(16);
  if (bits.next(16) != (length ^ 0xFFFF)) failBroken();
  for (unsigned k = 0; k < length; ++k) text += static_cast<char>(bits.next(8));
}

/// Decompresses a text of about `size` bytes; it may be longer or shorter if the archive is broken.
std::string inflate(std::string_view bytes, std::size_t size) {
  Bits bits(bytes);
  std::string text;
  for (bool is_last = false; !is_last && text.size() <= size;) {
    is_last = bits.next(1) == 1;
    const unsigned kind = bits.next(2);
    if (kind == 3) failBroken();
    if (kind == 0)
      readStored(bits, text);
    else
      readCompressed(bits, kind == 1 ? fixedCodes() : readCodes(bits), size, text);
  }
  return text;
}

/// The CRC-32 of some bytes, as in Ethernet.
std::size_t checksumOf(std::string_view bytes) {
  std::array<std::uint32_t, 256> table;
  for (std::uint32_t k = 0; k < 256; ++k) {
    table[k] = k;
    for (int bit = 0; bit < 8; ++bit) table[k] = table[k] >> 1 ^ (table[k] & 1 ? 0xEDB88320u : 0);
  }
  std::uint32_t sum = 0xFFFFFFFFu;
  for (const char c : bytes) sum = sum >> 8 ^ table[(sum ^ static_cast<unsigned char>(c)) & 0xFF];
  return sum ^ 0xFFFFFFFFu;
}

}  // namespace

bool isZip(std::string_view bytes) {
  return bytes.substr(0, 4) == "PK\3\4" || bytes.rfind("PK\5\6") != bytes.npos;
}

// Reads the record that ends the archive, then the directory before it, which must have no gaps.
ZipArchive::ZipArchive(std::string_view bytes) : bytes_(bytes) {
  const std::size_t end = bytes.rfind("PK\5\6");
  if (end == bytes.npos) failBroken();
  const std::size_t count = fieldAt(bytes, end + 10, 2), size = fieldAt(bytes, end + 12, 4),
                    offset = fieldAt(bytes, end + 16, 4);
  if (size > end || offset != end - size) failBroken();
  std::size_t at = offset, sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (bytes.substr(at, 4) != "PK\1\2" || (fieldAt(bytes, at + 8, 2) & 1) != 0) failBroken();
    const std::size_t name = fieldAt(bytes, at + 28, 2);
    entries_.push_back({std::string(bytes.substr(std::min(at + 46, end), name)),
                        fieldAt(bytes, at + 10, 2), fieldAt(bytes, at + 16, 4),
                        fieldAt(bytes, at + 20, 4), fieldAt(bytes, at + 24, 4),
                        fieldAt(bytes, at + 42, 4)});
    at += 46 + name + fieldAt(bytes, at + 30, 2) + fieldAt(bytes, at + 32, 2);
    sum += entries_.back().size;
  }
  if (at != end) failBroken();
  if (sum > kMostRatio * bytes.size())
    throw std::runtime_error("its ZIP archive holds " + std::to_string(sum) + " bytes, more than " +
                             std::to_string(kMostRatio) + " times its own");
  for (const Entry& entry : entries_) read(entry);
}

// Decompresses a file. Its own header, before the data, repeats what the directory says.
std::string ZipArchive::read(const Entry& entry) const {
  const std::size_t header = entry.header,
                    begin = header + 30 + entry.name.size() + fieldAt(bytes_, header + 28, 2);
  // Both must agree. The lengths and the checksum may follow the data instead.
  const bool has_lengths = (fieldAt(bytes_, header + 6, 2) & 8) == 0;
  if (bytes_.substr(header, 4) != "PK\3\4" || fieldAt(bytes_, header + 8, 2) != entry.method ||
      fieldAt(bytes_, header + 26, 2) != entry.name.size() || begin > bytes_.size() ||
      bytes_.substr(header + 30, entry.name.size()) != entry.name ||
      (has_lengths && (fieldAt(bytes_, header + 14, 4) != entry.checksum ||
                       fieldAt(bytes_, header + 18, 4) != entry.compressed ||
                       fieldAt(bytes_, header + 22, 4) != entry.size)) ||
      entry.compressed > bytes_.size() - begin)
    failBroken();
  const std::string_view stored = bytes_.substr(begin, entry.compressed);
  if (entry.method != 0 && entry.method != 8)
    throw std::runtime_error("its ZIP archive is compressed by method " +
                             std::to_string(entry.method) + ", which is not read");
  std::string text = entry.method == 8 ? inflate(stored, entry.size) : std::string(stored);
  if (text.size() != entry.size || checksumOf(text) != entry.checksum) failBroken();
  return text;
}

std::optional<std::string> ZipArchive::find(std::string_view name) const {
  for (const Entry& entry : entries_)
    if (entry.name == name) return read(entry);
  return std::nullopt;
}

}  // namespace adaptive_bvh
