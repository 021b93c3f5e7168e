#pragma once

#include <stdexcept>
#include <string>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh {

/// Component `mesh_io`: triangle meshes from files.

/// The axis of a frame that points up.
enum class UpAxis { AsInFile, X, Y, Z };

/// Options of `loadMesh`.
struct MeshLoadOptions {
  /// Joins vertices of equal position. Most formats (STL always) repeat a vertex for every face,
  /// which hides the connectivity of the surface (`weldVertices`).
  bool weld = true;

  /// Positions no farther apart than this count as equal; in the unit of the result. 0: only equal
  /// numbers.
  double weld_tolerance = 0;

  /// `AsInFile`: the axes of the file. Otherwise the mesh is rotated so that the up axis of its
  /// file becomes this one. Collada declares an up axis (by default Y), glTF is always Y up. The
  /// other formats declare none, and are never rotated.
  UpAxis up = UpAxis::AsInFile;

  /// Multiplies by the unit that the file declares, so that lengths are in metres: Collada, 3MF and
  /// AMF (millimetres where they name none), FBX. glTF is in metres. The other formats declare
  /// none, or theirs is not read.
  bool metres = true;

  /// With `metres`: the unit of the result, in metres. 0.001: all meshes are in millimetres.
  double unit = 1;

  /// With `metres`: the unit of files that declare none, in metres. 0.001: they are taken for
  /// millimetres.
  double undeclared_unit = 1;

  /// Multiplies all positions, after the unit. Positive.
  double scale = 1;

  /// Whether glTF buffers may be any files that this process can read. Otherwise only files in the
  /// folder of the document or below it are read: the name must be relative, must not climb out of
  /// the folder by "..", also in percent-encoded form, and the file must be there after links are
  /// followed. Where the document is a link itself, the folder that it leads to counts as well.
  bool buffers_outside_folder = false;
};

/// Error of a file that cannot be used. `what()` names the path and the reason, in UTF-8: other
/// bytes of a name or of the file, and control characters, are written as "\xE9".
class MeshLoadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads OBJ, STL, PLY, OFF, Collada and glTF in double precision, and other formats of assimp in
/// single precision. The format is recognised by the file's content, and else by its extension;
/// docs/guide.md lists formats and variants.
///
/// Vertices are in the order of the file. Polygons are triangulated by exact arithmetic; points and
/// lines are dropped, faces of zero area are kept if they are triangles. The transforms of the
/// scene's nodes are applied in double precision. A mirroring transform reverses the triangles, so
/// that they still face outside. The transform of a skinned glTF node is ignored, as its
/// specification requires, where all primitives have joints; a node with two parents is placed
/// twice; joints and morph weights are not applied. Several meshes become one.
///
/// Throws std::invalid_argument if an option is out of range. Throws MeshLoadError if the file is
/// missing, broken or not a regular file (links are followed), has no triangle, names a vertex that
/// does not exist, declares more elements than it has bytes, or has a coordinate that is not
/// finite; if a polygon crosses itself, or touches itself so that no triangles between its corners
/// fill it, or has more than 10,000 corners, or takes too long (the message names the face, counted
/// from 1); and if the scene exceeds these limits:
/// - 500 levels of nodes (glTF, Collada), of JSON values, or of XML elements;
/// - 20,000 nodes, a node counted once for each path to it, or four times as many as the file has
///   (a node of the scene that is its own descendant is always refused);
/// - 500,000 vertices and triangles, or one for two bytes of the file, placed by all nodes
///   together (for formats of assimp four times as many as the meshes have), unless each mesh is
///   placed once;
/// - for glTF and Collada, 500,000 vertices and corners, or one for each byte of the file, read for
///   all meshes together. A file exceeds this only where meshes read the same lists, or lists that
///   are not there.
///
/// Files may be broken or malicious. With these limits, a file of a format that is read here takes
/// at most 1 s and 100 MB for each megabyte of it that is begun, and once a second for all of its
/// polygons, or is refused. The bytes of a glTF file include those of the buffers that its scene
/// uses; no others are read. Formats of assimp are read in this process, by code that may crash on
/// a broken file (`.assbin` does). What assimp returns is checked; 3MF archives and the levels of
/// XML are checked before, and the limits of nodes and placed meshes apply. Files that the mesh
/// refers to (buffers) must be regular files, too.
TriangleMesh loadMesh(const std::string& path, const MeshLoadOptions& options = {});

}  // namespace adaptive_bvh
