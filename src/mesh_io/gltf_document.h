#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gltf_accessors.h"

namespace adaptive_bvh {

/// A glTF document, text or binary. Its JSON must satisfy `parseStrictly`.
struct GltfDocument {
  /// Throws std::runtime_error if it is broken, or requires an extension that changes positions.
  GltfDocument(const std::string& bytes, NamedFiles files);
  GltfDocument(const GltfDocument&) = delete;  // `accessors` refers to `json`
  GltfDocument& operator=(const GltfDocument&) = delete;

  const Json json;
  GltfAccessors accessors;
};

/// The scene of a document, and the elements of the document that it consists of.
struct GltfScene {
  /// Vertices of a mesh: those from `first_vertex` on are the positions of a primitive.
  struct Part {
    std::size_t first_vertex, primitive;
  };

  FileScene scene;
  std::vector<const Json*> nodes;        ///< by node of the scene; of its root: the document
  std::vector<const Json*> meshes;       ///< by mesh of the scene
  std::vector<std::vector<Part>> parts;  ///< by mesh of the scene
};

/// The scene, with the positions and triangles of its meshes. Without scenes, all nodes are placed,
/// and all meshes that no node refers to. Primitives share vertices if they have the same
/// positions, joints and morph targets.
GltfScene sceneOf(GltfDocument& document);

}  // namespace adaptive_bvh
