#include "mesh_io/gltf_format.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include <nlohmann/json.hpp>

#include "mesh_io/node_graph.h"

namespace adaptive_bvh {
namespace {

using Json = nlohmann::json;

const Json kNull;

/// A member or an element; null where there is none. glTF 2 refers to things by index, glTF 1 by
/// key.
const Json& at(const Json& container, const Json& key) {
  if (container.is_array() && key.is_number_unsigned()) {
    const auto index = key.get<std::size_t>();
    return index < container.size() ? container[index] : kNull;
  }
  if (!container.is_object() || !key.is_string()) return kNull;
  const auto found = container.find(key.get_ref<const std::string&>());
  return found == container.end() ? kNull : *found;
}

std::size_t numberAt(const Json& container, const char* key) {
  const Json& value = at(container, key);
  return value.is_number_unsigned() ? value.get<std::size_t>() : 0;
}

/// Valid UTF-8 from any bytes, different for different bytes: names in another encoding are no
/// error of a mesh.
std::string toUtf8(const std::string& bytes) {
  std::string text;
  text.reserve(bytes.size());
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      text += c;
    } else {
      text += static_cast<char>(0xC0 | byte >> 6);
      text += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  text.erase(text.find_last_not_of('\0') + 1);  // some writers pad with it
  return text;
}

/// Throws on a text that is nested too deep, or could be read in two ways. (A callback of
/// nlohmann's parser could tell the same, in time that grows with the square of an array's length.)
class JsonCheck : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool string(string_t& text) override {
    if (text.find('\0') != text.npos)
      throw std::runtime_error("its JSON text has a string with a zero in it");
    return true;
  }
  bool key(string_t& text) override {
    if (!open_.back().insert(text).second)
      throw std::runtime_error("an object of its JSON text has a key twice");
    return string(text);
  }
  bool start_object(std::size_t) override { return enter(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool end_array() override { return leave(); }
  bool parse_error(std::size_t, const std::string&, const Json::exception& error) override {
    throw std::runtime_error(std::string("it is no JSON text: ") + error.what());
  }

 private:
  bool enter() {
    open_.emplace_back();
    if (open_.size() > kMostLevels)
      throw std::runtime_error("its JSON text is nested in more than " +
                               std::to_string(kMostLevels) + " levels");
    return true;
  }
  bool leave() {
    open_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> open_;  ///< arrays and objects, with their keys so far
};

Json parse(const std::string& bytes) {
  const std::string text = toUtf8(bytes);
  JsonCheck check;
  Json::sax_parse(text, &check);
  return Json::parse(text);
}

/// The scenes come after the nodes, as nodes above them.
NodeGraph hierarchy(const Json& gltf) {
  const Json &nodes = at(gltf, "nodes"), &scenes = at(gltf, "scenes");
  std::map<Json, std::size_t> index;  // by what refers to a node
  for (const auto& item : nodes.items())
    index.emplace(nodes.is_object() ? Json(item.key()) : Json(index.size()), index.size());

  NodeGraph children;
  const auto add = [&](const Json& parent, const char* list) {
    for (const Json& child : at(parent, list)) {
      const auto found = index.find(child);
      if (found != index.end()) children.back().push_back(found->second);
    }
  };
  for (const Json& node : nodes) {
    children.emplace_back();
    add(node, "children");
    add(node, "skeletons");  // of glTF 1
  }
  for (const Json& scene : scenes) {
    children.emplace_back();
    add(scene, "nodes");
  }
  return children;
}

/// Sums that hostile numbers must not overflow.
void addTo(std::size_t& sum, std::size_t number) {
  constexpr std::size_t most = std::size_t{1} << 60;
  sum = std::min(sum + std::min(number, most), most);
}

/// What the meshes read: they may share accessors, and accessors the bytes of a buffer; assimp
/// copies for each.
struct Reading {
  const Json& gltf;
  std::size_t elements = 0;
  std::size_t bytes = 0;   ///< of the buffers that are read, each once
  std::set<Json> buffers;  ///< what refers to them

  void add(const Json& accessor_key) {
    const Json& accessor = at(at(gltf, "accessors"), accessor_key);
    addTo(elements, numberAt(accessor, "count"));
    const Json& buffer = at(at(at(gltf, "bufferViews"), at(accessor, "bufferView")), "buffer");
    if (buffers.insert(buffer).second)
      addTo(bytes, numberAt(at(at(gltf, "buffers"), buffer), "byteLength"));
  }
};

std::string findSharingError(const Json& gltf) {
  Reading reading{gltf, 0, 0, {}};
  for (const Json& mesh : at(gltf, "meshes"))
    for (const Json& primitive : at(mesh, "primitives")) {
      for (const Json& accessor : at(primitive, "attributes")) reading.add(accessor);
      for (const Json& target : at(primitive, "targets"))
        for (const Json& accessor : target) reading.add(accessor);
      reading.add(at(primitive, "indices"));
    }
  // An element takes a byte at least.
  if (reading.elements <= std::max(kMostElements, kMostElementsPerElement * reading.bytes))
    return "";
  return "its meshes read the same data so often that " + std::to_string(reading.elements) +
         " vertices and indices come of it";
}

/// How often assimp copies a value and what it holds: every level is copied twice. Parsed values
/// have few levels.
double copiesOf(const Json& value) {
  double copies = 1;
  if (value.is_structured())
    for (const Json& child : value) copies += 2 * copiesOf(child);
  return copies;
}

/// Extensions, which assimp copies in full, known or not.
std::string findExtensionError(const Json& gltf, std::size_t text_bytes) {
  double copies = 0;
  for (const Json& list : gltf)
    if (list.is_structured())
      for (const Json& object : list) copies += copiesOf(at(object, "extensions"));
  return copies > std::max(1e6, 16. * static_cast<double>(text_bytes))
             ? "its extensions are nested too deep"
             : "";
}

}  // namespace

std::string findGltfError(const std::string& text) {
  try {
    const Json gltf = parse(text);
    for (const std::string& error : {findHierarchyError(hierarchy(gltf)), findSharingError(gltf),
                                     findExtensionError(gltf, text.size())})
      if (!error.empty()) return error;
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

}  // namespace adaptive_bvh
