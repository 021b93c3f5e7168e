#include "adaptive_bvh/write_file.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <random>
#include <system_error>

namespace adaptive_bvh {
namespace {

namespace fs = std::filesystem;

/// Writes `file`. Errors name `path`. If the stream has failed, throws the system's error instead
/// of an exception of `write`.
void writeInto(const fs::path& file, const std::string& path,
               const std::function<void(std::ostream&)>& write) {
  errno = 0;
  std::ofstream out(file, std::ios::binary);
  try {
    if (out) write(out);
  } catch (...) {
    if (out) throw;
  }
  out.close();
  if (!out)
    throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(),
                            "cannot write '" + path + "'");
}

}  // namespace

void writeFile(const std::string& path, const std::function<void(std::ostream&)>& write) {
  const bool is_there = fs::exists(path);
  if (is_there && !fs::is_regular_file(path)) return writeInto(path, path, write);

  // The file that a link leads to: renaming to the link would replace it.
  const fs::path file = is_there ? fs::canonical(path) : fs::path(path);
  const fs::path draft = file.string() + '.' + std::to_string(std::random_device()()) + ".part";
  std::error_code error;
  try {
    writeInto(draft, path, write);
    if (is_there) fs::permissions(draft, fs::status(file).permissions(), error);
    fs::rename(draft, file, error);
    if (error) throw std::system_error(error, "cannot write '" + path + "'");
  } catch (...) {
    fs::remove(draft, error);
    throw;
  }
}

}  // namespace adaptive_bvh
