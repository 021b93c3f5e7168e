#include <algorithm>
#include <map>
#include <vector>

#include "formats.h"
#include "strict_json.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

using Json = nlohmann::json;

const Json kNull;

/// Counts are cut to it where they are added up.
constexpr std::size_t kMostCount = std::size_t{1} << 40;

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

std::size_t countAt(const Json& container, const char* key, std::size_t otherwise = 0) {
  const Json& value = at(container, key);
  if (value.is_null()) return otherwise;
  if (!value.is_number_unsigned())
    throw std::runtime_error(std::string("a ") + key + " is no count");
  return value.get<std::size_t>();
}

std::string textAt(const Json& container, const char* key) {
  const Json& value = at(container, key);
  return value.is_string() ? value.get<std::string>() : "";
}

/// Numbers of a list that has so many; the others stay where there is no list.
template <std::size_t Size>
void readNumbers(const Json& container, const char* key, double (&numbers)[Size]) {
  const Json& list = at(container, key);
  if (list.is_null()) return;
  if (!list.is_array() || list.size() != Size ||
      !std::all_of(list.begin(), list.end(), [](const Json& x) { return x.is_number(); }))
    throw std::runtime_error(std::string("a ") + key + " has not " + std::to_string(Size) +
                             " numbers");
  for (std::size_t k = 0; k < Size; ++k) numbers[k] = list[k].get<double>();
}

Eigen::Matrix4d transformOf(const Json& node) {
  double matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  double translation[3] = {}, rotation[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
  readNumbers(node, "matrix", matrix);
  readNumbers(node, "translation", translation);
  readNumbers(node, "rotation", rotation);
  readNumbers(node, "scale", scale);
  Eigen::Affine3d parts = Eigen::Affine3d::Identity();
  parts.translate(Eigen::Vector3d(translation));
  const Eigen::Quaterniond q(rotation[3], rotation[0], rotation[1], rotation[2]);
  if (q.coeffs() != Eigen::Vector4d(0, 0, 0, 1)) parts.rotate(q.normalized());
  parts.scale(Eigen::Vector3d(scale));
  return Eigen::Matrix4d(matrix) * parts.matrix();
}

std::string fromBase64(std::string_view text) {
  std::string bytes;
  std::uint32_t group = 0;
  int bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const std::size_t digit =
        std::string_view("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/")
            .find(c);
    if (digit == std::string_view::npos) throw std::runtime_error("a buffer is not in base64");
    group = group << 6 | static_cast<std::uint32_t>(digit);
    if ((bits += 6) < 8) continue;
    bytes += static_cast<char>(group >> (bits -= 8) & 0xFF);
  }
  return bytes;
}

/// A name in a URI: "%20" is a blank.
std::string fromUri(const std::string& uri) {
  std::string name;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned code = 0;
    const char* const end = uri.data() + std::min(i + 3, uri.size());
    if (uri[i] == '%' &&
        std::from_chars(uri.data() + i + 1, end, code, 16).ptr == uri.data() + i + 3) {
      name += static_cast<char>(code);
      i += 2;
    } else {
      name += uri[i];
    }
  }
  return name;
}

BinaryType typeOf(std::size_t component_type) {
  switch (component_type) {
    case 5120: return {'i', 1};
    case 5121: return {'u', 1};
    case 5122: return {'i', 2};
    case 5123: return {'u', 2};
    case 5125: return {'u', 4};
    case 5126: return {'f', 4};
    default:
      throw std::runtime_error("an accessor has the unknown component type " +
                               std::to_string(component_type));
  }
}

/// From -1 to 1, or 0 to 1, of the integers of a type.
double normalized(double number, BinaryType type) {
  const int digits = 8 * static_cast<int>(type.bytes) - (type.kind == 'i' ? 1 : 0);
  return type.kind == 'f' ? number : std::max(number / (std::ldexp(1., digits) - 1), -1.);
}

/// Extensions that say nothing of positions.
bool isHarmless(const std::string& extension) {
  for (const char* prefix :
       {"KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_xmp",
        "EXT_texture_", "EXT_lights_", "MSFT_texture_", "KHR_binary_glTF"})
    if (extension.rfind(prefix, 0) == 0) return true;
  return false;
}

class GltfReader {
 public:
  GltfReader(const std::string& json, std::string binary, const std::string& path)
      : gltf_(parseStrictly(json)),
        binary_(std::move(binary)),
        folder_(path.substr(0, path.find_last_of('/') + 1)) {}

  FileScene read() {
    for (const Json& extension : at(gltf_, "extensionsRequired"))
      if (extension.is_string() && !isHarmless(extension.get<std::string>()))
        throw std::runtime_error("it requires the extension " + extension.get<std::string>() +
                                 ", which is not read");
    addNodes();
    checkHierarchy(scene_.nodes);  // before meshes are read
    checkSharing();
    for (const Json& mesh : at(gltf_, "meshes")) {
      scene_.meshes.emplace_back();
      for (const Json& primitive : at(mesh, "primitives")) addPrimitive(primitive);
    }
    scene_.up = UpAxis::Y;
    return std::move(scene_);
  }

 private:
  /// Numbers for what refers to the elements of a list.
  static std::map<Json, std::size_t> numbersOf(const Json& list) {
    std::map<Json, std::size_t> numbers;
    for (const auto& item : list.items())
      numbers.emplace(list.is_object() ? Json(item.key()) : Json(numbers.size()), numbers.size());
    return numbers;
  }

  static void addNumber(const std::map<Json, std::size_t>& numbers, const Json& key,
                        std::size_t first, std::vector<std::size_t>& list) {
    const auto found = numbers.find(key);
    if (found != numbers.end()) list.push_back(first + found->second);
  }

  /// The first node is the scene.
  void addNodes() {
    const Json &nodes = at(gltf_, "nodes"), &scenes = at(gltf_, "scenes");
    const auto node_numbers = numbersOf(nodes), mesh_numbers = numbersOf(at(gltf_, "meshes"));
    const auto addAll = [](const auto& numbers, const Json& keys, std::size_t first, auto& list) {
      for (const Json& key : keys) addNumber(numbers, key, first, list);
    };
    const Json& named = at(gltf_, "scene");
    const Json& scene = at(scenes, named.is_null() && scenes.is_array() ? Json(0u) : named);
    scene_.nodes.emplace_back();
    addAll(node_numbers, at(scene, "nodes"), 1, scene_.nodes[0].children);
    for (const Json& source : nodes) {
      SceneNode node;
      node.transform = transformOf(source);
      node.is_skinned = !at(source, "skin").is_null() || !at(source, "skeletons").is_null();
      addNumber(mesh_numbers, at(source, "mesh"), 0, node.meshes);
      addAll(mesh_numbers, at(source, "meshes"), 0, node.meshes);  // of glTF 1
      addAll(node_numbers, at(source, "children"), 1, node.children);
      scene_.nodes.push_back(std::move(node));
    }
  }

  /// Meshes may share accessors, and accessors the bytes of a buffer.
  void checkSharing() {
    std::size_t elements = 0, bytes = 0;
    const auto add = [&](const Json& accessor) {
      elements += std::min(countAt(at(at(gltf_, "accessors"), accessor), "count"), kMostCount);
    };
    for (const Json& mesh : at(gltf_, "meshes"))
      for (const Json& primitive : at(mesh, "primitives")) {
        add(at(at(primitive, "attributes"), "POSITION"));
        add(at(primitive, "indices"));
      }
    for (const auto& buffer : numbersOf(at(gltf_, "buffers")))
      bytes += bufferOf(buffer.first).size();
    if (elements > std::max(kMostElements, kMostElementsPerElement * bytes))
      throw std::runtime_error("its meshes read the same data so often that " +
                               std::to_string(elements) + " vertices and indices come of it");
  }

  void addPrimitive(const Json& primitive) {
    const Json& positions = at(at(primitive, "attributes"), "POSITION");
    const std::size_t mode = countAt(primitive, "mode", countAt(primitive, "primitive", 4));
    if (mode < 4 || positions.is_null()) return;  // points and lines
    const std::vector<double> coordinates = read(positions, 3);
    PolygonMesh& mesh = scene_.meshes.back();
    const std::size_t first = mesh.vertices.size();
    for (std::size_t i = 0; i < coordinates.size(); i += 3)
      mesh.vertices.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);

    const Json& indices = at(primitive, "indices");
    std::vector<std::size_t> corners;
    if (indices.is_null())
      for (std::size_t v = first; v < mesh.vertices.size(); ++v) corners.push_back(v);
    else
      for (const double index : read(indices, 1))
        corners.push_back(first + indexOf(index, coordinates.size() / 3));
    using Layout = PolygonMesh::Layout;
    mesh.addTriangles(corners, mode == 4 ? Layout::List : mode == 5 ? Layout::Strip : Layout::Fan);
  }

  static std::size_t indexOf(double index, std::size_t vertices) {
    if (index >= 0 && index < static_cast<double>(vertices)) return static_cast<std::size_t>(index);
    throw std::runtime_error("a triangle names vertex " + textOf(index) + " of " +
                             std::to_string(vertices));
  }

  /// An accessor's numbers, `width` for each element.
  std::vector<double> read(const Json& key, std::size_t width) {
    const Json& accessor = at(at(gltf_, "accessors"), key);
    const std::string form = width == 3 ? "VEC3" : "SCALAR";
    if (textAt(accessor, "type") != form)
      throw std::runtime_error("an accessor is not of type " + form);
    const std::size_t count = countAt(accessor, "count");
    const BinaryType type = typeOf(countAt(accessor, "componentType"));
    std::vector<double> numbers(count * width);
    if (!at(accessor, "bufferView").is_null()) numbers = readView(accessor, type, count, width);
    const Json& sparse = at(accessor, "sparse");
    if (!sparse.is_null()) {
      const std::size_t changes = countAt(sparse, "count");
      const Json& where = at(sparse, "indices");
      const auto indices = readView(where, typeOf(countAt(where, "componentType")), changes, 1);
      const auto changed = readView(at(sparse, "values"), type, changes, width);
      for (std::size_t i = 0; i < changes; ++i)
        std::copy_n(changed.data() + width * i, width,
                    numbers.data() + width * indexOf(indices[i], count));
    }
    if (at(accessor, "normalized") == Json(true))
      for (double& number : numbers) number = normalized(number, type);
    return numbers;
  }

  std::vector<double> readView(const Json& source, BinaryType type, std::size_t count,
                               std::size_t width) {
    const Json& view = at(at(gltf_, "bufferViews"), at(source, "bufferView"));
    const std::string_view buffer = bufferOf(at(view, "buffer"));
    const std::size_t begin = countAt(view, "byteOffset"), length = countAt(view, "byteLength"),
                      offset = countAt(source, "byteOffset"), size = type.bytes * width;
    std::size_t stride = countAt(view, "byteStride", countAt(source, "byteStride"));
    if (stride == 0) stride = size;
    // In this order, nothing overflows.
    if (begin > buffer.size() || length > buffer.size() - begin)
      throw std::runtime_error("a part of a buffer reaches past its end");
    if (count > 0 && (offset > length || size > length - offset ||
                      count - 1 > (length - offset - size) / stride))
      throw std::runtime_error("an accessor reaches past its part of a buffer");

    std::vector<double> numbers;
    numbers.reserve(count * width);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < width; ++k)
        numbers.push_back(numberAt(buffer, begin + offset + stride * i + k * type.bytes, type));
    return numbers;
  }

  /// Each is read once.
  std::string_view bufferOf(const Json& key) {
    const auto known = buffers_.find(key);
    if (known != buffers_.end()) return known->second;
    const Json& buffer = at(at(gltf_, "buffers"), key);
    const std::string uri = textAt(buffer, "uri");
    if (uri.empty() || uri == "data:,") return binary_;
    std::string& bytes = buffers_[key];
    if (uri.rfind("data:", 0) == 0)
      bytes = fromBase64(std::string_view(uri).substr(std::min(uri.find(','), uri.size() - 1) + 1));
    else
      bytes = readFile(folder_ + fromUri(uri));
    return bytes;
  }

  const Json gltf_;
  const std::string binary_;  ///< the buffer of a binary file
  const std::string folder_;
  std::map<Json, std::string> buffers_;
  FileScene scene_;
};

/// After a header of three words, chunks of JSON and of bytes. In version 1 a header of five words,
/// JSON, and bytes.
FileScene readBinary(const std::string& bytes, const std::string& path) {
  const bool is_old = bytes.size() >= 20 && wordAt(bytes, 4) == 1;
  std::string parts[2];
  std::size_t at = 12;
  for (std::string& part : parts) {
    if (at == 12 && bytes.size() < 20) throw std::runtime_error("its header does not end");
    if (bytes.size() < at + 8) break;
    const std::size_t length = wordAt(bytes, at);
    at += 8;
    if (length > bytes.size() - at)
      throw std::runtime_error("it announces a chunk of " + std::to_string(length) +
                               " bytes, and has " + std::to_string(bytes.size() - at));
    part = bytes.substr(at, length);
    at += length;
    if (is_old) {
      parts[1] = bytes.substr(at);
      break;
    }
  }
  return GltfReader(parts[0], std::move(parts[1]), path).read();
}

}  // namespace

FileScene readGltf(const std::string& bytes, const std::string& path) {
  if (bytes.compare(0, 4, "glTF") == 0) return readBinary(bytes, path);
  return GltfReader(bytes, "", path).read();
}

}  // namespace adaptive_bvh
