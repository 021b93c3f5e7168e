#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "named_files.h"
#include "scene.h"
#include "xml.h"

namespace adaptive_bvh {

/// \name One reader a format, each in a file of its own
/// Of the bytes of a file. They read positions as the file has them, in double, and throw
/// std::runtime_error, saying what is wrong: a file announces more than it has bytes, ends early,
/// or has words where numbers must be. Texts may begin with a byte order mark.
/// \{

PolygonMesh readObj(std::string_view text);

/// As text, whatever the case of its words, and without an `endsolid`; or binary, with bytes after
/// the last triangle, or with payloads: bytes after each triangle, as many as its attribute count.
PolygonMesh readStl(std::string_view bytes);

/// Whether a file has just the bytes of the triangles that it announces as a binary STL file, with
/// or without payloads.
bool hasLengthOfBinaryStl(std::string_view bytes);

/// As text, an element a line, or binary of either byte order; faces and triangle strips.
PolygonMesh readPly(std::string_view bytes);

/// As text, with normals, colours or texture coordinates, which are left out.
PolygonMesh readOff(std::string_view bytes);

/// glTF 2 and 1, as text or binary, with the files of its buffers. It must be JSON by
/// `parseStrictly`. Accessors of integers are read as the file says (KHR_mesh_quantization); other
/// required extensions that change positions are refused by name. Without scenes, all nodes are
/// placed, and all meshes that no node names.
FileScene readGltf(const std::string& bytes, NamedFiles buffers);

/// Collada. Declares the axis that is up, and the unit.
FileScene readCollada(const std::string& text);

/// Everything else, by assimp, in single precision. Declares the unit of FBX.
FileScene readByAssimp(const std::string& path);

/// The unit in metres that an AMF file declares, which assimp does not pass on, by the root of its
/// text; nothing where that is another format. Throws where the unit is unknown.
std::optional<double> unitOfAmf(const XmlElement& root);

/// The unit of a 3MF archive. Throws, too, where the archive is broken or has no model: assimp ends
/// the process then.
double unitOf3mf(std::string_view bytes);

/// \}

/// One of the readers above, by the beginning of the file and then by the name's extension.
FileScene readScene(const std::string& path, const MeshLoadOptions& options);

/// The bytes of a regular file. Throws std::runtime_error when it is none or cannot be read.
std::string readFile(const std::string& path);

/// A pipe or a device can block forever, or never end. A link to a file is a regular one.
bool isRegularFile(const std::string& path);

}  // namespace adaptive_bvh
