#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {

/// \name Parts of a glTF document
/// References point into the document, so the address of a part identifies it.
/// \{

using Json = nlohmann::json;

/// A member or element; null if there is none. glTF 2 refers to elements by index, glTF 1 by key.
const Json& at(const Json& container, const Json& key);

/// A count, or `otherwise` if it is missing. Throws std::runtime_error if it is not a count.
std::size_t countAt(const Json& container, const char* key, std::size_t otherwise = 0);

/// A member that is a string; empty if it is not.
const std::string& textAt(const Json& container, const char* key);

/// \}

}  // namespace adaptive_bvh
