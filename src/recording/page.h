#pragma once

#include <iosfwd>
#include <string>

#include "blob.h"

namespace adaptive_bvh {

/// Writes the page that plays a run: JSON, and the arrays that it refers to.
void writePage(const std::string& title, const std::string& run, const Blob& arrays,
               std::ostream& out);

}  // namespace adaptive_bvh
