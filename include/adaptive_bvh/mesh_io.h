#pragma once

#include <stdexcept>
#include <string>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh {

/// Component `mesh_io`: triangle meshes from files, by assimp. Positions are in the file's unit,
/// and triangles face outside as far as the file says so.

/// How `loadMesh` prepares what it read.
struct MeshLoadOptions {
  /// Make vertices of exactly equal position one. Most formats (STL always) repeat a vertex for
  /// every face, which hides the connectivity of the surface (`weldVertices`).
  bool weld = true;
};

/// A file could not be used. `what()` names the path and the reason.
class MeshLoadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads OBJ, STL, PLY, DAE (Collada), glTF and what else assimp reads. Polygons are triangulated,
/// points and lines dropped. The transforms of the scene's nodes are applied, with the file's unit
/// scale, in double; a transform that mirrors turns the triangles over, so that they keep facing
/// outside. Several meshes become one. Faces of zero area are kept.
///
/// Throws MeshLoadError when the file is missing, broken or no regular file (links are followed),
/// holds no triangle, names a vertex that it does not have, announces more elements than it has
/// bytes, or has a coordinate that is not finite; and when its scene is beyond these limits:
/// - 500 levels of nodes (glTF, Collada), of JSON values, or of XML elements;
/// - 20,000 nodes, a node counted once for each way that leads to it, or four times as many as the
///   file has (glTF, Collada; a node below itself is refused in any number);
/// - 10 million vertices and triangles from meshes that several nodes place, or four times as many
///   as the meshes have; of glTF, 10 million elements read by its meshes, or four for each byte of
///   its buffers.
///
/// Broken files are not trusted, but they are read by assimp, in this process. STL, PLY, OFF,
/// Collada and glTF are checked before; of other formats that nest nodes, and of compressed files,
/// only the limit of placed meshes holds. Files that the mesh names (buffers, materials) must be
/// regular files too.
template <typename S>
TriangleMesh<S> loadMesh(const std::string& path, const MeshLoadOptions& options = {});

extern template TriangleMesh<float> loadMesh(const std::string&, const MeshLoadOptions&);
extern template TriangleMesh<double> loadMesh(const std::string&, const MeshLoadOptions&);

}  // namespace adaptive_bvh
