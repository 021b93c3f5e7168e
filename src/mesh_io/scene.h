#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "adaptive_bvh/mesh_io.h"
#include "polygon_mesh.h"

namespace adaptive_bvh {

/// Levels of nodes, or of the text around them, that a file may have.
constexpr std::size_t kMostLevels = 500;

/// A file may have so many nodes, a node counted once for each way that leads to it, or
/// `kMostPlacementsPerNode` times as many as are written in it, whichever is more.
constexpr std::size_t kMostPlacements = 20000, kMostPlacementsPerNode = 4;

/// Placed meshes, with so many vertices and triangles in all; or so many times what the file holds.
constexpr std::size_t kMostElements = 10000000, kMostElementsPerElement = 4;

struct SceneNode {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();  ///< to its parent
  std::vector<std::size_t> children;                        ///< nodes; several may share one
  std::vector<std::size_t> meshes;
  bool is_skinned = false;  ///< its meshes stay where they are, whatever the transforms
};

/// What a file holds.
struct FileScene {
  std::vector<PolygonMesh> meshes;
  std::vector<SceneNode> nodes;
  std::size_t root = 0;          ///< the node that is placed, with those below it
  UpAxis up = UpAxis::AsInFile;  ///< which axis the file says is up; `AsInFile` where it does not
  double unit = 1;               ///< metres
};

/// Throws std::runtime_error when the nodes are no hierarchy: a node below itself, too many levels,
/// or too many nodes where several name the same child.
void checkHierarchy(const std::vector<SceneNode>& nodes);

/// Triangles in the frame of the root, transformed by `root`. Throws std::runtime_error by
/// `checkHierarchy` and `triangulate`, and when the nodes place meshes too often.
TriangleMesh<double> flatten(FileScene scene, const Eigen::Matrix4d& root);

}  // namespace adaptive_bvh
