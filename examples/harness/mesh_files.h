#pragma once

#include <string>

#include "surface.h"

namespace harness {

/// Writes a binary file in single precision, little-endian. Throws std::runtime_error, which names
/// the path, when it cannot be written.
void writePly(const Surface& surface, const std::string& path);
void writeStl(const Surface& surface, const std::string& path);

}  // namespace harness
