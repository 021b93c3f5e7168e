#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace adaptive_bvh {

/// Whether a file begins as a ZIP archive, or has the record that ends one.
bool isZip(std::string_view bytes);

/// The files of a ZIP archive. Keeps a view of its bytes.
class ZipArchive {
 public:
  /// Decompresses every file once. Throws std::runtime_error where one is broken, is compressed by
  /// another method than Deflate, or where they are more than `kMostRatio` times the archive.
  explicit ZipArchive(std::string_view bytes);

  /// The bytes of a file, by its name; nothing where there is none.
  std::optional<std::string> find(std::string_view name) const;

  /// Texts of meshes are compressed to a tenth, or a thirtieth if they are very regular.
  static constexpr std::size_t kMostRatio = 64;

 private:
  struct Entry {
    std::string name;
    std::size_t method, checksum, compressed, size;
    std::size_t header;  ///< where it begins
  };
  std::string read(const Entry& entry) const;

  std::string_view bytes_;
  std::vector<Entry> entries_;
};

}  // namespace adaptive_bvh
