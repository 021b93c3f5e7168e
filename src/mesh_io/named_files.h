#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace adaptive_bvh {

/// The files that a document names. Each is read once, however many names lead to it.
class NamedFiles {
 public:
  /// Unless they may be `anywhere`, only files in the folder of the document, or below it.
  NamedFiles(const std::string& document, bool anywhere);

  /// The bytes of a file; they stay where they are. A relative name begins at the folder of the
  /// document. Throws std::runtime_error where it is no regular file, or none that may be read: the
  /// name is absolute or climbs out of the folder, or links lead to another folder than that of the
  /// document, its own link followed or not.
  const std::string& read(const std::string& name);

  /// Of all files that were read.
  std::size_t bytes() const { return bytes_; }

 private:
  const std::string document_;
  const bool anywhere_;
  std::map<std::string, std::string> contents_;  ///< by path without links
  std::size_t bytes_ = 0;
};

}  // namespace adaptive_bvh
