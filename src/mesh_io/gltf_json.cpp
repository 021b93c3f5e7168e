// Access to parts of a glTF document that may be missing or of another type.
#include "gltf_json.h"

#include <stdexcept>

namespace adaptive_bvh {

const Json& at(const Json& container, const Json& key) {
  static const Json kNull;
  if (container.is_array() && key.is_number_unsigned()) {
    const auto index = key.get<std::size_t>();
    return index < container.size() ? container[index] : kNull;
  }
  if (!container.is_object() || !key.is_string()) return kNull;
  const auto found = container.find(key.get_ref<const std::string&>());
  return found == container.end() ? kNull : *found;
}

std::size_t countAt(const Json& container, const char* key, std::size_t otherwise) {
  const Json& value = at(container, key);
  if (value.is_null()) return otherwise;
  if (!value.is_number_unsigned())
    throw std::runtime_error(std::string("a ") + key + " is not a count");
  return value.get<std::size_t>();
}

const std::string& textAt(const Json& container, const char* key) {
  static const std::string kEmpty;
  const Json& value = at(container, key);
  return value.is_string() ? value.get_ref<const std::string&>() : kEmpty;
}

}  // namespace adaptive_bvh
