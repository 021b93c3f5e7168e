// Reads glTF: the nodes of the scene, then the meshes that they refer to. at(container, key)
// returns a part of the JSON document, or null if it is missing (gltf_json.h).
#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "formats.h"
#include "gltf_document.h"

namespace adaptive_bvh {
namespace {

/// Reads the numbers of a list of this size; leaves them unchanged if there is no list.
template <std::size_t Size>
void readNumbers(const Json& container, const char* key, double (&numbers)[Size]) {
  const Json& list = at(container, key);
  if (list.is_null()) return;
  if (!list.is_array() || list.size() != Size ||
      !std::all_of(list.begin(), list.end(), [](const Json& x) { return x.is_number(); }))
    throw std::runtime_error(std::string("a ") + key + " does not have " + std::to_string(Size) +
                             " numbers");
  for (std::size_t k = 0; k < Size; ++k) numbers[k] = list[k].get<double>();
}

/// The transform of a node to its parent: a matrix, or translation, rotation and scale.
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

/// Numbers JSON values in the order of their first use.
class Numbering {
 public:
  /// The number of a value; a new one at its first use.
  std::size_t numberOf(const Json& thing) {
    const auto [found, is_new] = numbers_.emplace(&thing, things_.size());
    if (is_new) things_.push_back(&thing);
    return found->second;
  }

  bool has(const Json& thing) const { return numbers_.count(&thing) != 0; }
  std::size_t size() const { return things_.size(); }
  const Json& operator[](std::size_t number) const { return *things_[number]; }
  const std::vector<const Json*>& all() const { return things_; }

 private:
  std::map<const Json*, std::size_t> numbers_;
  std::vector<const Json*> things_;
};

class GltfReader {
 public:
  explicit GltfReader(GltfDocument& document)
      : gltf_(document.json), accessors_(document.accessors) {}

  GltfScene read() {
    addNodes();
    checkHierarchy(scene_.nodes);  // before meshes are read
    scene_.meshes.reserve(meshes_.size());
    for (std::size_t m = 0; m < meshes_.size(); ++m) addMesh(meshes_[m]);
    for (SceneNode& node : scene_.nodes)
      for (const std::size_t mesh : node.meshes) node.is_skinned &= has_joints_[mesh];
    scene_.up = UpAxis::Y;
    scene_.unit = 1;
    scene_.bytes = accessors_.bytes();
    return {std::move(scene_), nodes_.all(), meshes_.all(), std::move(parts_)};
  }

 private:
  /// Adds the scene as first node, then all nodes below it.
  void addNodes() {
    const Json &scenes = at(gltf_, "scenes"), &scene_key = at(gltf_, "scene");
    nodes_.numberOf(gltf_);  // number 0 stands for the scene
    SceneNode scene;
    if (scenes.empty())
      scene.children = rootNodes();
    else
      addAll(at(gltf_, "nodes"),
             at(at(scenes, scene_key.is_null() ? Json(0u) : scene_key), "nodes"), nodes_,
             scene.children);
    // Assigns numbers to all nodes below; nodes_ grows in the loop.
    for (std::size_t n = 1; n < nodes_.size(); ++n) childrenOf(nodes_[n]);
    scene_.nodes.reserve(nodes_.size());
    scene_.nodes.push_back(std::move(scene));
    for (std::size_t n = 1; n < nodes_.size(); ++n) scene_.nodes.push_back(nodeOf(nodes_[n]));
    if (scenes.empty()) addUnnamedMeshes();
  }

  /// Appends the numbers of the elements that a key or a list refers to. Ignores unknown keys.
  static void addAll(const Json& things, const Json& keys, Numbering& numbering,
                     std::vector<std::size_t>& numbers) {
    for (const Json& key : keys) {
      const Json& thing = at(things, key);
      if (!thing.is_null()) numbers.push_back(numbering.numberOf(thing));
    }
  }

  std::vector<std::size_t> childrenOf(const Json& node) {
    std::vector<std::size_t> children;
    addAll(at(gltf_, "nodes"), at(node, "children"), nodes_, children);
    return children;
  }

  SceneNode nodeOf(const Json& source) {
    SceneNode node;
    node.transform = transformOf(source);
    node.is_skinned = !at(source, "skin").is_null() || !at(source, "skeletons").is_null();
    node.children = childrenOf(source);
    const Json& meshes = at(gltf_, "meshes");
    for (const char* key : {"mesh", "meshes"})  // of glTF 2, and of glTF 1
      addAll(meshes, at(source, key), meshes_, node.meshes);
    return node;
  }

  /// The nodes that are not children of other nodes, for a file without scenes.
  std::vector<std::size_t> rootNodes() {
    std::set<const Json*> children;
    const Json& nodes = at(gltf_, "nodes");
    for (const Json& node : nodes)
      for (const Json& key : at(node, "children")) children.insert(&at(nodes, key));
    std::vector<std::size_t> roots;
    for (const Json& node : nodes) {
      if (at(node, "children").empty() && at(node, "mesh").is_null() && at(node, "meshes").empty())
        continue;  // places nothing
      const std::size_t number = nodes_.numberOf(node);
      if (children.count(&node) == 0) roots.push_back(number);
    }
    return roots;
  }

  /// Places meshes that no node refers to, without a transform, for a file without scenes.
  void addUnnamedMeshes() {
    for (const Json& mesh : at(gltf_, "meshes"))
      if (!meshes_.has(mesh)) scene_.nodes[0].meshes.push_back(meshes_.numberOf(mesh));
  }

  /// What two primitives must have in common to share vertices.
  static Json sharedBy(const Json& primitive) {
    Json shared = Json::array({at(primitive, "targets")});
    for (const char* key : {"POSITION", "JOINTS_0", "JOINTS_1", "WEIGHTS_0", "WEIGHTS_1"})
      shared.push_back(at(at(primitive, "attributes"), key));
    return shared;
  }

  /// Adds a mesh: the triangles of all its primitives.
  void addMesh(const Json& source) {
    PolygonMesh& mesh = scene_.meshes.emplace_back();
    auto& parts = parts_.emplace_back();
    has_joints_.push_back(true);
    std::map<Json, std::size_t> first_vertices;  // by what primitives share
    const Json& primitives = at(source, "primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const Json& primitive = at(primitives, i);
      const Json& attributes = at(primitive, "attributes");
      const Json& key = at(attributes, "POSITION");
      const std::size_t mode = countAt(primitive, "mode", countAt(primitive, "primitive", 4));
      if (mode < 4 || key.is_null()) continue;  // 0 to 3 are points and lines
      if (at(attributes, "JOINTS_0").is_null() && at(attributes, "JOINT").is_null())
        has_joints_.back() = false;
      const Json& accessor = at(at(gltf_, "accessors"), key);
      const auto [first, is_new] =
          first_vertices.emplace(sharedBy(primitive), mesh.vertices.size());
      if (is_new) {
        parts.push_back({mesh.vertices.size(), i});
        const std::vector<double> numbers = accessors_.numbers(accessor, "VEC3");
        for (std::size_t k = 0; k < numbers.size(); k += 3)
          mesh.vertices.emplace_back(numbers[k], numbers[k + 1], numbers[k + 2]);
      }
      addTriangles(primitive, mode, first->second, countAt(accessor, "count"), mesh);
    }
  }

  void addTriangles(const Json& primitive, std::size_t mode, std::size_t first_vertex,
                    std::size_t vertices, PolygonMesh& mesh) {
    const Json& key = at(primitive, "indices");
    std::vector<std::size_t> corners =
        accessors_.indices(key.is_null() ? nullptr : &at(at(gltf_, "accessors"), key), vertices);
    for (std::size_t& corner : corners) corner += first_vertex;
    using Layout = PolygonMesh::Layout;
    mesh.addTriangles(corners, mode == 4 ? Layout::List : mode == 5 ? Layout::Strip : Layout::Fan);
  }

  const Json& gltf_;
  GltfAccessors& accessors_;
  Numbering nodes_, meshes_;  ///< nodes and meshes of the scene
  FileScene scene_;
  std::vector<std::vector<GltfScene::Part>> parts_;  ///< by mesh
  std::vector<bool> has_joints_;  ///< by mesh: whether joints move all of its vertices
};

}  // namespace

GltfScene sceneOf(GltfDocument& document) { return GltfReader(document).read(); }

}  // namespace adaptive_bvh
