#include "adaptive_bvh/mesh_io.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include "format_check.h"
#include "node_graph.h"

namespace adaptive_bvh {
namespace {

using Matrix4d = Eigen::Matrix4d;
using Mesh = TriangleMesh<double>;

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw MeshLoadError("cannot load mesh '" + path + "': " + reason);
}

/// A pipe or a device can block forever, or never end. A link to a file is one.
bool isRegularFile(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// Also for the files that a mesh names: buffers, materials.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override { return isRegularFile(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return isRegularFile(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }
};

Matrix4d toDouble(const aiMatrix4x4& m) {
  Matrix4d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      result(row, column) = static_cast<double>(m[static_cast<unsigned>(row)][column]);
  return result;
}

void append(const aiMesh& source, const Matrix4d& transform, Mesh& mesh) {
  const std::size_t offset = mesh.vertices.size();
  for (unsigned v = 0; v < source.mNumVertices; ++v) {
    const aiVector3D& p = source.mVertices[v];
    const Eigen::Vector4d q(p.x, p.y, p.z, 1);
    mesh.vertices.emplace_back((transform * q).head<3>());
  }
  const bool mirrored = transform.topLeftCorner<3, 3>().determinant() < 0;
  for (unsigned f = 0; f < source.mNumFaces; ++f) {
    const aiFace& face = source.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines; polygons are triangles by now
    std::size_t corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = offset + face.mIndices[k];
    if (mirrored) std::swap(corner[1], corner[2]);
    mesh.triangles.emplace_back(corner[0], corner[1], corner[2]);
  }
}

/// Before assimp triangulates: it aborts on a face without corners, and looks up the vertices of
/// one with more than three, whether they are there or not.
void checkFaces(const aiScene& scene, const std::string& path) {
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    const aiMesh& mesh = *scene.mMeshes[i];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices == 0) fail(path, "a face has no corners");
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        if (face.mIndices[k] >= mesh.mNumVertices)
          fail(path, "a face names vertex " + std::to_string(face.mIndices[k]) + " of " +
                         std::to_string(mesh.mNumVertices));
    }
  }
}

/// What the nodes make of the meshes, in vertices and triangles.
class PlacedElements {
 public:
  explicit PlacedElements(const aiScene& scene) {
    std::size_t own = 0;
    for (unsigned i = 0; i < scene.mNumMeshes; ++i) own += elementsOf(*scene.mMeshes[i]);
    most_ = std::max(kMostElements, kMostElementsPerElement * own);
  }

  /// False when it is too much.
  bool add(const aiMesh& mesh) { return (sum_ += elementsOf(mesh)) <= most_; }
  std::size_t most() const { return most_; }

 private:
  static std::size_t elementsOf(const aiMesh& mesh) {
    return std::size_t{mesh.mNumVertices} + mesh.mNumFaces;
  }

  std::size_t sum_ = 0, most_;
};

/// Walks the scene with an explicit stack: other formats may nest as deep as assimp can read.
Mesh flatten(const aiScene& scene, const std::string& path) {
  struct Item {
    const aiNode* node;
    Matrix4d parent;
  };
  Mesh mesh;
  PlacedElements placed(scene);
  std::vector<Item> stack = {{scene.mRootNode, Matrix4d::Identity()}};
  while (!stack.empty()) {
    const Item item = stack.back();
    stack.pop_back();
    const Matrix4d transform = item.parent * toDouble(item.node->mTransformation);
    for (unsigned i = 0; i < item.node->mNumMeshes; ++i) {
      const aiMesh& source = *scene.mMeshes[item.node->mMeshes[i]];
      if (!placed.add(source))
        fail(path, "its nodes place meshes so often that more than " +
                       std::to_string(placed.most()) + " vertices and triangles come of them");
      append(source, transform, mesh);
    }
    for (unsigned i = item.node->mNumChildren; i-- > 0;)  // the first child is next
      stack.push_back({item.node->mChildren[i], transform});
  }
  return mesh;
}

/// Before assimp sees it.
void checkFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !isRegularFile(path))
    fail(path, "it is no regular file");
  if (!std::ifstream(path).good()) fail(path, "the file does not exist or cannot be read");
  const std::string format_error = findFormatError(path);
  if (!format_error.empty()) fail(path, format_error);
}

Mesh readMesh(const std::string& path) {
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // the importer's from now on
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* scene = importer.ReadFile(path, 0);
  if (!scene) fail(path, importer.GetErrorString());
  checkFaces(*scene, path);
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (!scene) fail(path, importer.GetErrorString());
  if (!scene->mRootNode) fail(path, "the scene is empty");
  return flatten(*scene, path);
}

}  // namespace

template <typename S>
TriangleMesh<S> loadMesh(const std::string& path, const MeshLoadOptions& options) {
  checkFile(path);
  Mesh mesh = readMesh(path);
  if (mesh.triangles.empty()) fail(path, "it holds no triangles");
  if (options.weld) weldVertices(mesh);

  TriangleMesh<S> result;
  result.triangles = std::move(mesh.triangles);
  result.vertices.reserve(mesh.vertices.size());
  for (const fcl::Vector3<double>& p : mesh.vertices) {
    result.vertices.push_back(p.cast<S>());
    if (!result.vertices.back().allFinite()) fail(path, "a coordinate is not finite");
  }
  return result;
}

template TriangleMesh<float> loadMesh(const std::string&, const MeshLoadOptions&);
template TriangleMesh<double> loadMesh(const std::string&, const MeshLoadOptions&);

}  // namespace adaptive_bvh
