#pragma once

#include <string>

namespace adaptive_bvh {

/// The format check: what is wrong with a file that assimp cannot be given as it is; empty when
/// nothing is, or the format is one that is not checked (formats.h lists those that are). assimp's
/// readers allocate and loop by what a header announces before they look whether it is there, so
/// that a few bytes can take all memory, or all time.
std::string findFormatError(const std::string& path);

}  // namespace adaptive_bvh
