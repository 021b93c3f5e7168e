// Checks the hierarchy of a file's nodes, and flattens it to one mesh.
#include "scene.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace adaptive_bvh {
namespace {

using Matrix4d = Eigen::Matrix4d;
using Mesh = TriangleMesh;

/// The state of a node in checkHierarchy.
struct NodeState {
  enum { New, Open, Done } state = New;  ///< `Open` on the path from the root to the current node
  std::size_t children_done = 0;         ///< number of children that are Done
  std::size_t levels = 1;                ///< levels of its subtree
  std::size_t placements = 1;  ///< nodes of its subtree, counted once for each path to them
};

/// Adds a transformed mesh to another. Reverses triangles if the transform mirrors them.
void place(const Mesh& source, const Matrix4d& transform, Mesh& mesh) {
  const std::size_t offset = mesh.vertices.size();
  for (const fcl::Vector3d& p : source.vertices)
    mesh.vertices.emplace_back((transform * p.homogeneous()).head<3>());
  const bool mirrored = transform.topLeftCorner<3, 3>().determinant() < 0;
  for (fcl::Triangle t : source.triangles) {
    if (mirrored) std::swap(t[1], t[2]);
    mesh.triangles.emplace_back(offset + t[0], offset + t[1], offset + t[2]);
  }
}

/// The number of elements to place. An empty mesh counts as one, because placing it takes time.
std::size_t elementsOf(const Mesh& mesh) {
  return mesh.vertices.size() + mesh.triangles.size() + 1;
}

/// The limit on placed vertices and triangles. Meshes that are placed only once never exceed it.
ElementLimit placementLimit(const FileScene& scene, const std::vector<Mesh>& meshes) {
  std::size_t placed_once = 0;
  for (const Mesh& mesh : meshes) placed_once += elementsOf(mesh);
  const std::size_t most =
      scene.bytes > 0 ? std::max(placed_once, scene.bytes / 2) : 4 * placed_once;
  return {"its nodes place meshes so often", most};
}

/// Triangulates a mesh; if there are several, prefixes errors with "mesh 2: ".
Mesh triangulateAs(std::size_t number, std::size_t count, PolygonMesh mesh, WorkLimit& work) {
  try {
    return triangulate(std::move(mesh), work);
  } catch (const std::runtime_error& error) {
    if (count == 1) throw;
    throw std::runtime_error("mesh " + std::to_string(number) + ": " + error.what());
  }
}

/// The root and the nodes below it, depth first.
std::vector<Placement> placementsOf(const FileScene& scene) {
  std::vector<Placement> placements, open = {{scene.root, 0}};  // open: the next one is the last
  while (!open.empty()) {
    const Placement next = open.back();
    open.pop_back();
    placements.push_back(next);
    const std::vector<std::size_t>& children = scene.nodes[next.node].children;
    for (auto child = children.rbegin(); child != children.rend(); ++child)
      open.push_back({*child, next.level + 1});
  }
  return placements;
}

}  // namespace

void ElementLimit::take(std::size_t elements) {
  const std::size_t most = std::max(kMostElements, allowed_);
  if (elements > most - taken_)
    throw std::runtime_error(std::string(cause_) + " that more than " + std::to_string(most) +
                             " vertices and triangles come of it");
  taken_ += elements;
}

/// Traverses depth first with an explicit stack: children are completed before their parents.
void checkHierarchy(const std::vector<SceneNode>& nodes) {
  const std::size_t most_placements =
      std::max(kMostPlacements, kMostPlacementsPerNode * nodes.size());
  std::vector<NodeState> states(nodes.size());
  std::vector<std::size_t> path;
  for (std::size_t root = 0; root < nodes.size(); ++root) {
    if (states[root].state == NodeState::New) path.push_back(root);
    while (!path.empty()) {
      const std::vector<std::size_t>& children = nodes[path.back()].children;
      NodeState& node = states[path.back()];
      node.state = NodeState::Open;
      if (node.children_done == children.size()) {
        node.state = NodeState::Done;
        path.pop_back();
        continue;
      }
      const std::size_t next = children[node.children_done];
      const NodeState& child = states[next];
      if (child.state == NodeState::Open)
        throw std::runtime_error("a node is among its own descendants");
      if (child.state == NodeState::New) {
        path.push_back(next);
        continue;
      }
      ++node.children_done;
      node.levels = std::max(node.levels, child.levels + 1);
      node.placements += child.placements;  // no overflow, because each is at most the limit
      if (node.levels > kMostLevels)
        throw std::runtime_error("its nodes are nested in more than " +
                                 std::to_string(kMostLevels) + " levels");
      if (node.placements > most_placements)
        throw std::runtime_error("its nodes share children so often that more than " +
                                 std::to_string(most_placements) + " nodes would be placed");
    }
  }
}

PlacedMeshes placedMeshes(FileScene& scene) {
  checkHierarchy(scene.nodes);
  std::size_t corners = 0;
  for (const PolygonMesh& mesh : scene.meshes) corners += mesh.corners.size();
  WorkLimit work(kPolygonSteps + kPolygonStepsPerCorner * corners);
  PlacedMeshes placed{{}, placementsOf(scene)};
  for (PolygonMesh& mesh : scene.meshes)
    placed.meshes.push_back(
        triangulateAs(placed.meshes.size() + 1, scene.meshes.size(), std::move(mesh), work));
  ElementLimit limit = placementLimit(scene, placed.meshes);
  for (const Placement& placement : placed.placements)
    for (const std::size_t mesh : scene.nodes[placement.node].meshes)
      limit.take(elementsOf(placed.meshes[mesh]));
  return placed;
}

Mesh flatten(FileScene scene, const Matrix4d& root) {
  const PlacedMeshes placed = placedMeshes(scene);
  std::vector<Matrix4d> transforms = {root};  // of the path to a node, to the caller's frame
  Mesh result;
  for (const auto& [number, level] : placed.placements) {
    const SceneNode& node = scene.nodes[number];
    transforms.resize(level + 1);
    transforms.push_back(transforms.back() * node.transform);
    for (const std::size_t mesh : node.meshes)
      place(placed.meshes[mesh], node.is_skinned ? root : transforms.back(), result);
  }
  return result;
}

}  // namespace adaptive_bvh
