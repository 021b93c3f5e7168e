// Reads the files that a document names, if they are allowed.
#include "named_files.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "formats.h"

namespace adaptive_bvh {
namespace {

namespace fs = std::filesystem;

/// No known system has longer paths.
constexpr std::size_t kLongestName = 4096;

fs::path folderOf(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Whether a name cannot lead out of its folder, apart from links.
bool staysBelow(const fs::path& name) {
  return !name.has_root_path() && *name.lexically_normal().begin() != "..";
}

/// Whether a file is in a folder or below it. Both paths must be free of links.
bool isBelow(const fs::path& folder, const fs::path& file) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first ==
         folder.end();
}

}  // namespace

NamedFiles::NamedFiles(const std::string& document, bool anywhere)
    : document_(document), anywhere_(anywhere) {}

const std::string& NamedFiles::read(const std::string& name) {
  if (name.empty() || name.size() > kLongestName || name.find('\0') != name.npos)
    throw std::runtime_error("it names a file by a name that is not valid");
  const auto refuse = [&] {
    throw std::runtime_error("it names the file '" + name +
                             "', which is not in its folder or below it");
  };
  if (!anywhere_ && !staysBelow(name)) refuse();
  const fs::path folder = folderOf(document_), path = folder / name;
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  if (error) throw std::runtime_error("'" + path.string() + "' does not exist or cannot be read");
  if (!anywhere_ && !isBelow(fs::canonical(folder), real) &&
      !isBelow(folderOf(fs::canonical(document_)), real))
    refuse();
  const auto [found, is_new] = contents_.try_emplace(real.string());
  if (is_new) bytes_ += (found->second = readFile(real.string())).size();
  return found->second;
}

}  // namespace adaptive_bvh
