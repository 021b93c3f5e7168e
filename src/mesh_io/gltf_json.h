#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {

/// \name Parts of a glTF document
/// The references are into the document, so that the address of a part identifies it.
/// \{

using Json = nlohmann::json;

/// A member or an element; null where there is none. glTF 2 refers to things by index, glTF 1 by
/// key.
const Json& at(const Json& container, const Json& key);

/// A member that is a count. Throws std::runtime_error where it is something else.
std::size_t countAt(const Json& container, const char* key, std::size_t otherwise = 0);

/// A member that is a text; empty where it is none.
const std::string& textAt(const Json& container, const char* key);

/// \}

}  // namespace adaptive_bvh
