#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {

/// JSON that every reader reads alike: few levels, no object that has a key twice, no string with a
/// zero in it. A UTF-8 byte order mark is skipped. Text in another encoding than UTF-8 is no error:
/// its bytes become characters.
/// Throws std::runtime_error, saying what is wrong.
nlohmann::json parseStrictly(const std::string& bytes);

}  // namespace adaptive_bvh
