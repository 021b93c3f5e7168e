#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "named_files.h"
#include "scene.h"
#include "xml.h"

namespace adaptive_bvh {

struct GltfDocument;

/// \name One reader per format, each in its own file
/// Readers take the bytes of a file, and return positions in double precision as the file has them.
/// They throw std::runtime_error with a reason if a file announces more data than it has bytes,
/// ends early, or has words where numbers must be. Texts may begin with a byte order mark.
/// \{

PolygonMesh readObj(std::string_view text);

/// Reads text STL, case-insensitive and with or without `endsolid`, or binary STL. A binary file
/// may have bytes after the last triangle, or payloads: bytes after each triangle, as many as its
/// attribute count.
PolygonMesh readStl(std::string_view bytes);

/// Whether a file has exactly the length of a binary STL file, with or without payloads.
bool hasLengthOfBinaryStl(std::string_view bytes);

/// Reads text PLY, with one element per line, or binary PLY of either byte order; faces and
/// triangle strips.
PolygonMesh readPly(std::string_view bytes);

/// Reads text OFF. Ignores normals, colours and texture coordinates.
PolygonMesh readOff(std::string_view bytes);

/// Reads Collada, with its up axis and unit.
FileScene readCollada(const std::string& text);

/// Reads all other formats with assimp, in single precision, with the unit of FBX.
FileScene readByAssimp(const std::string& path);

/// The unit in metres that an AMF file declares, which assimp does not pass on. `root` is the root
/// of its text; nothing for other formats. Throws if the unit is unknown.
std::optional<double> unitOfAmf(const XmlElement& root);

/// The unit in metres of a 3MF archive. Also throws if the archive is broken or has no model,
/// because assimp then ends the process.
double unitOf3mf(std::string_view bytes);

/// \}

/// Reads a file with the reader that its beginning, or else the name's extension, determines.
FileScene readScene(const std::string& path, const MeshLoadOptions& options);

/// Whether a file declares its unit, or its format defines one.
bool declaresUnit(const std::string& path);

/// Opens glTF 2 or 1, with buffers in the folder of the file or below it; null for other formats.
std::unique_ptr<GltfDocument> openGltf(const std::string& path);

/// Throws MeshLoadError, which names the file and the reason.
[[noreturn]] void failToLoad(const std::string& path, const std::string& reason);

/// The bytes of a regular file. Throws std::runtime_error if it is not one, or cannot be read.
std::string readFile(const std::string& path);

/// Whether a path is a regular file, or a link to one. (A pipe or device could block forever.)
bool isRegularFile(const std::string& path);

}  // namespace adaptive_bvh
