// Reads ZIP archives: their directory, and files compressed by Deflate (RFC 1951), by zlib.
#include "zip.h"

#define ZLIB_CONST  // next_in points to const bytes
#include <zlib.h>

#include <algorithm>
#include <new>
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

/// Decompresses a file of `size` bytes from a Deflate stream.
std::string inflated(std::string_view bytes, std::size_t size) {
  std::string text(size, '\0');
  z_stream stream{};
  stream.next_in = reinterpret_cast<const Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(size);
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();  // without zlib's header
  const bool is_whole = inflate(&stream, Z_FINISH) == Z_STREAM_END && stream.avail_out == 0;
  inflateEnd(&stream);
  if (!is_whole) failBroken();
  return text;
}

std::size_t checksumOf(std::string_view bytes) {
  return crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
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
  std::string text = entry.method == 8 ? inflated(stored, entry.size) : std::string(stored);
  if (text.size() != entry.size || checksumOf(text) != entry.checksum) failBroken();
  return text;
}

std::optional<std::string> ZipArchive::find(std::string_view name) const {
  for (const Entry& entry : entries_)
    if (entry.name == name) return read(entry);
  return std::nullopt;
}

}  // namespace adaptive_bvh
