#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "gltf_json.h"
#include "named_files.h"

namespace adaptive_bvh {

/// The buffers of a glTF document: in the binary file itself, in other files, or in data URIs. Each
/// is read or decoded when first needed.
class GltfBuffers {
 public:
  /// `chunk` is the embedded buffer of a binary file (.glb).
  GltfBuffers(std::string chunk, NamedFiles files)
      : chunk_(std::move(chunk)), files_(std::move(files)) {}

  /// The bytes of a buffer, valid as long as this object. Throws std::runtime_error on failure.
  std::string_view bytesOf(const Json& buffer);

  /// The total bytes of all files that were read.
  std::size_t fileBytes() const { return files_.bytes(); }

 private:
  std::string_view read(const std::string& uri);

  std::string chunk_;
  NamedFiles files_;
  std::deque<std::string> decoded_;                  ///< contents of data URIs
  std::map<const Json*, std::string_view> buffers_;  ///< results of bytesOf
};

}  // namespace adaptive_bvh
