#include "coloured_parts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Exporter.hpp>

namespace tools {
namespace {

using Point = fcl::Vector3d;

/// Neighbouring numbers get hues far apart.
aiColor4D colourOf(std::size_t number) {
  const double hue = 6 * std::fmod(0.61803398875 * double(number), 1.);
  const double value = number % 3 == 0 ? 0.95 : number % 3 == 1 ? 0.8 : 0.62;
  const auto channel = [&](double shift) {
    const double k = std::fmod(hue + shift, 6.);
    return float(value * (1 - 0.65 * std::max(0., std::min({k, 4 - k, 1.}))));
  };
  return {channel(5), channel(3), channel(1), 1};
}

/// assimp's scene owns all it points to.
void add(aiScene& scene, unsigned at, const Part& part) {
  const auto vector = [](const Point& p) {
    return aiVector3D(ai_real(p[0]), ai_real(p[1]), ai_real(p[2]));
  };
  const auto& [vertices, triangles] = part.mesh;
  auto* mesh = scene.mMeshes[at] = new aiMesh;
  mesh->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  mesh->mMaterialIndex = at;
  mesh->mNumVertices = unsigned(vertices.size());
  mesh->mVertices = new aiVector3D[vertices.size()];
  mesh->mColors[0] = new aiColor4D[vertices.size()];
  std::transform(vertices.begin(), vertices.end(), mesh->mVertices, vector);
  std::fill_n(mesh->mColors[0], vertices.size(), colourOf(at));
  if (!part.normals.empty()) {
    mesh->mNormals = new aiVector3D[vertices.size()];
    std::transform(part.normals.begin(), part.normals.end(), mesh->mNormals, vector);
  }
  mesh->mNumFaces = unsigned(triangles.size());
  mesh->mFaces = new aiFace[triangles.size()];
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    mesh->mFaces[t].mNumIndices = 3;
    mesh->mFaces[t].mIndices = new unsigned[3];
    for (int k = 0; k < 3; ++k) mesh->mFaces[t].mIndices[k] = unsigned(triangles[t][k]);
  }
  const aiColor4D colour = colourOf(at);
  scene.mMaterials[at] = new aiMaterial;
  scene.mMaterials[at]->AddProperty(&colour, 1, AI_MATKEY_COLOR_DIFFUSE);
  scene.mRootNode->mMeshes[at] = at;
}

}  // namespace

void write(const std::vector<Part>& parts, const std::string& path) {
  const std::map<std::string, const char*> formats = {
      {".ply", "ply"}, {".obj", "obj"}, {".gltf", "gltf2"}, {".glb", "glb2"}, {".stl", "stlb"}};
  const auto format = formats.find(std::filesystem::path(path).extension().string());
  if (format == formats.end())
    throw std::runtime_error("'" + path + "' must end in .ply, .obj, .gltf, .glb or .stl");
  const auto count = unsigned(parts.size());
  aiScene scene;
  scene.mNumMeshes = scene.mNumMaterials = count;
  scene.mMeshes = new aiMesh*[count];
  scene.mMaterials = new aiMaterial*[count];
  scene.mRootNode = new aiNode;
  scene.mRootNode->mNumMeshes = count;
  scene.mRootNode->mMeshes = new unsigned[count];
  for (unsigned i = 0; i < count; ++i) add(scene, i, parts[i]);
  Assimp::Exporter exporter;
  if (exporter.Export(&scene, format->second, path) != aiReturn_SUCCESS)
    throw std::runtime_error("cannot write '" + path + "': " + exporter.GetErrorString());
}

}  // namespace tools
