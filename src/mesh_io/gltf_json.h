#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {

/// \name Parts of a glTF document
/// References point into the document, so the address of a part identifies it.
/// \{

using Json = nlohmann::json;

/// The member or element of a container with this key or index; null if there is none, or if
/// `container` is null. (glTF 2 refers to elements by index, glTF 1 by key.)
const Json& at(const Json& container, const Json& key);

/// The member as a count; `otherwise` if it is missing. Throws std::runtime_error for other values.
std::size_t countAt(const Json& container, const char* key, std::size_t otherwise = 0);

/// The member of an object as a string; empty if it is missing or not a string.
const std::string& textAt(const Json& container, const char* key);

/// \}

}  // namespace adaptive_bvh
