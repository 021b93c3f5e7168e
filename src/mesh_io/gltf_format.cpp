#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "formats.h"
#include "node_graph.h"
#include "strict_json.h"
#include "tokens.h"

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
    const Json gltf = parseStrictly(text);
    for (const std::string& error : {findHierarchyError(hierarchy(gltf)), findSharingError(gltf),
                                     findExtensionError(gltf, text.size())})
      if (!error.empty()) return error;
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

std::string findGlbError(const std::string& bytes) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  for (std::size_t at = kHeader; at + kChunkHeader <= bytes.size();) {
    const std::size_t length = wordAt(bytes, at);
    at += kChunkHeader;
    if (length > bytes.size() - at)
      return "it announces a chunk of " + std::to_string(length) + " bytes, and has " +
             std::to_string(bytes.size() - at);
    at += length;
  }
  if (bytes.size() < kHeader + kChunkHeader) return "its header does not end";
  return findGltfError(bytes.substr(kHeader + kChunkHeader, wordAt(bytes, kHeader)));
}

}  // namespace adaptive_bvh
