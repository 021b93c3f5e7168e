#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace adaptive_bvh {

/// The files that a document refers to. Each is read once, even if several names refer to it.
class NamedFiles {
 public:
  /// Allows files `anywhere`, or only in the document's folder and below.
  NamedFiles(const std::string& document, bool anywhere);

  /// The bytes of a file; the reference stays valid as long as this object. A relative name is
  /// relative to the document's folder. Throws std::runtime_error if it is not a regular file, or
  /// not allowed: the name is absolute or leads out of the folder, or links lead out of the
  /// document's folder (the folder of its path, or of the file that its own link leads to).
  const std::string& read(const std::string& name);

  std::size_t bytes() const { return bytes_; }  ///< the total bytes of all files that were read

 private:
  const std::string document_;
  const bool anywhere_;
  std::map<std::string, std::string> contents_;  ///< by path without links
  std::size_t bytes_ = 0;
};

}  // namespace adaptive_bvh
