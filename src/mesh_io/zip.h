#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace adaptive_bvh {

/// Whether a file begins like a ZIP archive, or contains the record that ends one.
bool isZip(std::string_view bytes);

/// The files in a ZIP archive. Keeps a view of its bytes.
class ZipArchive {
 public:
  /// Decompresses every file once to check it. Throws std::runtime_error if a file is broken or
  /// compressed by another method than Deflate, or if the files are more than `kMostRatio` times
  /// larger than the archive.
  explicit ZipArchive(std::string_view bytes);

  /// The bytes of the file with this name; nothing if there is none.
  std::optional<std::string> find(std::string_view name) const;

  /// The largest compression ratio. Mesh texts are compressed to a tenth, or to a thirtieth if they
  /// are very regular.
  static constexpr std::size_t kMostRatio = 64;

 private:
  /// A file, as the archive's directory describes it.
  struct Entry {
    std::string name;
    std::size_t method;  ///< 0: stored; 8: Deflate
    std::size_t checksum, compressed,
        size;            ///< CRC-32; numbers of bytes in the archive, and of the file
    std::size_t header;  ///< position of the file's own header
  };
  std::string read(const Entry& entry) const;

  std::string_view bytes_;
  std::vector<Entry> entries_;
};

}  // namespace adaptive_bvh
