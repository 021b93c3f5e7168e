#include "adaptive_bvh/detail/write_file.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <random>
#include <system_error>

namespace adaptive_bvh {
namespace {

namespace fs = std::filesystem;

/// Opens `file` and calls write(stream). If the file cannot be opened or the stream fails, throws
/// std::system_error, which names `path`, also if `write` threw an exception because of that.
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

void detail::writeFile(const std::string& path, const std::function<void(std::ostream&)>& write) {
  const bool exists = fs::exists(path);
  if (exists && !fs::is_regular_file(path)) return writeInto(path, path, write);  // a pipe, say

  fs::path file = path;  // at the end of the links: a rename would replace a link
  while (fs::is_symlink(file)) file = file.parent_path() / fs::read_symlink(file);
  const fs::path draft = file.string() + '.' + std::to_string(std::random_device()()) + ".part";
  std::error_code error;
  try {
    writeInto(draft, path, write);
    if (exists) fs::permissions(draft, fs::status(file).permissions(), error);
    fs::rename(draft, file, error);
    if (error) throw std::system_error(error, "cannot write '" + path + "'");
  } catch (...) {
    fs::remove(draft, error);
    throw;
  }
}

}  // namespace adaptive_bvh
