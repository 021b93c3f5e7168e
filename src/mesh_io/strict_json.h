#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {

/// Parses JSON that every parser reads alike: limited nesting, no object with a duplicate key, no
/// string with a zero character. Skips a UTF-8 byte order mark. Bytes of other encodings than UTF-8
/// are accepted as characters. Throws std::runtime_error with the reason.
nlohmann::json parseStrictly(const std::string& bytes);

}  // namespace adaptive_bvh
