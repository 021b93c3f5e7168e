// Reads other formats with assimp, and checks what it returns.
#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <cmath>
#include <stdexcept>

#include "formats.h"

namespace adaptive_bvh {
namespace {

/// Opens regular files only, also for files that a mesh refers to.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override { return isRegularFile(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return isRegularFile(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }
};

/// Throws if the distance from the origin leaves fewer than 8 of the 24 bits of assimp's numbers to
/// the shape: a solid may then have become flat.
void checkPrecision(const std::vector<fcl::Vector3d>& vertices) {
  Eigen::AlignedBox3d box;
  double largest = 0;
  for (const fcl::Vector3d& p : vertices) {
    box.extend(p);
    largest = std::max(largest, p.lpNorm<Eigen::Infinity>());
  }
  if (!vertices.empty() && box.sizes().maxCoeff() < 0x1p-16 * largest)
    throw std::runtime_error(
        "its shape is small beside its distance from the origin, and this format is read in "
        "single precision");
}

/// Throws unless assimp's scene is valid; `what` names what is wrong with it.
void check(bool is_valid, const char* what) {
  if (!is_valid) throw std::runtime_error(std::string("it was read with ") + what);
}

/// Converts a mesh; checks everything it uses, except corner indices, which `triangulate` checks.
PolygonMesh polygonsOf(const aiMesh& source) {
  check(source.mVertices || source.mNumVertices == 0, "a mesh that lacks its vertices");
  check(source.mFaces || source.mNumFaces == 0, "a mesh that lacks its faces");
  PolygonMesh mesh;
  for (unsigned v = 0; v < source.mNumVertices; ++v) {
    const aiVector3D& p = source.mVertices[v];
    mesh.vertices.emplace_back(p.x, p.y, p.z);
  }
  for (unsigned f = 0; f < source.mNumFaces; ++f) {
    const aiFace& face = source.mFaces[f];
    check(face.mIndices || face.mNumIndices == 0, "a face that lacks its corners");
    mesh.corners.insert(mesh.corners.end(), face.mIndices, face.mIndices + face.mNumIndices);
    mesh.endFace();
  }
  checkPrecision(mesh.vertices);
  return mesh;
}

/// Converts a node without its children; `meshes` is the number of meshes in the scene.
SceneNode nodeOf(const aiNode& source, unsigned meshes) {
  check(source.mMeshes || source.mNumMeshes == 0, "a node that lacks its meshes");
  for (unsigned i = 0; i < source.mNumMeshes; ++i)
    check(source.mMeshes[i] < meshes, "a node that names no mesh");
  SceneNode node;
  for (unsigned row = 0; row < 4; ++row)
    for (unsigned column = 0; column < 4; ++column)
      node.transform(row, column) = static_cast<double>(source.mTransformation[row][column]);
  node.meshes.assign(source.mMeshes, source.mMeshes + source.mNumMeshes);
  return node;
}

/// The unit in metres. FBX gives it in centimetres; for other formats assimp passes on no unit.
std::optional<double> unitOf(const aiScene& source) {
  double centimetres = 0;
  float single = 0;  // the type depends on assimp's version
  if (!source.mMetaData) return std::nullopt;
  if (!source.mMetaData->Get("UnitScaleFactor", centimetres)) {
    if (!source.mMetaData->Get("UnitScaleFactor", single)) return std::nullopt;
    centimetres = static_cast<double>(single);
  }
  check(centimetres > 0 && std::isfinite(centimetres), "a unit that is not positive");
  return centimetres / 100;
}

}  // namespace

FileScene readByAssimp(const std::string& path) {
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // the importer takes ownership
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* const source = importer.ReadFile(path, aiProcess_ValidateDataStructure);
  if (!source) throw std::runtime_error(importer.GetErrorString());
  if (!source->mRootNode) throw std::runtime_error("the scene is empty");

  FileScene scene;
  scene.unit = unitOf(*source);
  check(source->mMeshes || source->mNumMeshes == 0, "a list of meshes that is missing");
  for (unsigned i = 0; i < source->mNumMeshes; ++i) {
    check(source->mMeshes[i] != nullptr, "a mesh that is missing");
    scene.meshes.push_back(polygonsOf(*source->mMeshes[i]));
  }
  // With an explicit list instead of recursion: nodes may be nested as deep as assimp can read.
  std::vector<const aiNode*> nodes = {source->mRootNode};
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    scene.nodes.push_back(nodeOf(*nodes[n], source->mNumMeshes));
    check(nodes[n]->mChildren || nodes[n]->mNumChildren == 0, "a node that lacks its children");
    for (unsigned i = 0; i < nodes[n]->mNumChildren; ++i) {
      check(nodes[n]->mChildren[i] != nullptr, "a node that is missing");
      scene.nodes.back().children.push_back(nodes.size());
      nodes.push_back(nodes[n]->mChildren[i]);
    }
  }
  return scene;
}

}  // namespace adaptive_bvh
