#pragma once

#include <string>
#include <string_view>

namespace adaptive_bvh {

/// The text as valid UTF-8 without control characters: other bytes become a code such as "\xE9".
std::string printable(std::string_view text);

/// A word in quotation marks, for a message; long words are truncated.
std::string quote(std::string_view word);

}  // namespace adaptive_bvh
