#pragma once

#include <string>
#include <string_view>

namespace adaptive_bvh {

/// Valid UTF-8 without control characters: other bytes become "\xE9".
std::string printable(std::string_view text);

/// A word in quotation marks, for a message: its beginning, if it is long.
std::string quote(std::string_view word);

}  // namespace adaptive_bvh
