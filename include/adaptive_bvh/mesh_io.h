#pragma once

#include <stdexcept>
#include <string>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh {

/// Component `mesh_io`: triangle meshes from files.

/// Which axis of a frame points up.
enum class UpAxis { AsInFile, X, Y, Z };

/// How `loadMesh` prepares what it read.
struct MeshLoadOptions {
  /// Make vertices of equal position one. Most formats (STL always) repeat a vertex for every face,
  /// which hides the connectivity of the surface (`weldVertices`).
  bool weld = true;

  /// Positions no farther apart than this count as equal; in the unit of the result. 0: only equal
  /// numbers.
  double weld_tolerance = 0;

  /// `AsInFile`: the axes of the file. Otherwise a mesh is turned until the axis that its file
  /// declares as up is this one. Collada declares one (Y where it does not say), glTF is always Y
  /// up. The other formats declare none, and are never turned.
  UpAxis up = UpAxis::AsInFile;

  /// Multiply by the unit that the file declares (Collada), so that lengths are metres. glTF is in
  /// metres. The other formats declare none.
  bool metres = true;

  /// Multiplies all positions, after the unit. Positive.
  double scale = 1;
};

/// A file could not be used. `what()` names the path and the reason.
class MeshLoadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads OBJ, STL, PLY, OFF, Collada and glTF, in double precision, and what else assimp reads, in
/// single precision. The format is recognised by the file's content, and else by its extension;
/// docs/guide.md lists formats and variants.
///
/// Vertices are in the order of the file. Polygons are triangulated by exact arithmetic; points and
/// lines are dropped, faces of zero area kept if they are triangles. The transforms of the scene's
/// nodes are applied in double; a transform that mirrors turns the triangles over, so that they
/// keep facing outside. A skinned node of glTF keeps its meshes where they are, as its
/// specification says; joints and morph weights are not applied. Several meshes become one.
///
/// Throws std::invalid_argument when an option is out of range. Throws MeshLoadError when the file
/// is missing, broken or no regular file (links are followed), holds no triangle, names a vertex
/// that it does not have, announces more elements than it has bytes, or has a coordinate that is
/// not finite; when a polygon crosses itself, or touches itself so that no triangles between its
/// corners fill it, or has more than 10,000 corners (the message names the face, counted from 1);
/// and when the scene is beyond these limits:
/// - 500 levels of nodes (glTF, Collada), of JSON values, or of XML elements;
/// - 20,000 nodes, a node counted once for each way that leads to it, or four times as many as the
///   file has (a node below itself is refused in any number);
/// - 10 million vertices and triangles from meshes that several nodes place, or four times as many
///   as the meshes have; of glTF, 10 million elements read by its meshes, or four for each byte of
///   the buffer.
///
/// Broken files are not trusted. Those that assimp reads are read in this process; only the limits
/// of nodes and placed meshes hold for them. Files that the mesh names (buffers) must be regular
/// files too.
template <typename S>
TriangleMesh<S> loadMesh(const std::string& path, const MeshLoadOptions& options = {});

extern template TriangleMesh<float> loadMesh(const std::string&, const MeshLoadOptions&);
extern template TriangleMesh<double> loadMesh(const std::string&, const MeshLoadOptions&);

}  // namespace adaptive_bvh
