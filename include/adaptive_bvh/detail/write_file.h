#pragma once

#include <functional>
#include <iosfwd>
#include <string>

// Not part of the interface: shared by the library, its components and its Python module.
namespace adaptive_bvh::detail {

/// Writes a file as a whole: `write` fills a new file in the same folder, which then takes the
/// place and the permissions of the file at `path`. If anything fails, a full disk for example, the
/// file that was there before stays as it was, and the new one is removed. A link stays a
/// link, also one to a file that is not there yet. What is no regular file, a pipe or a device, is
/// written directly; a folder is refused.
///
///     writeFile("hose.mesh", [&](std::ostream& out) { mesh.save(out); });
///
/// Throws std::system_error, whose `what()` names the path and the reason, when the file cannot be
/// written; and what `write` throws, unless its stream has failed.
void writeFile(const std::string& path, const std::function<void(std::ostream&)>& write);

}  // namespace adaptive_bvh::detail
