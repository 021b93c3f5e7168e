#pragma once

#include <string>

namespace adaptive_bvh {

/// \name One check a format, each in a file of its own
/// What is wrong with the text (the bytes) of a file before assimp may read it; empty when nothing
/// is.
/// \{

/// Header and body are walked through; every element must be there.
std::string findPlyError(const std::string& text);

/// As text: facets of three vertices, all numbers; assimp would leak what it has read. Binary files
/// are not checked further.
std::string findStlError(const std::string& text);

/// No count may exceed the number of bytes, and most lines after the vertices must be faces.
std::string findOffError(const std::string& text);

/// The JSON text of glTF, version 1 or 2. It must be JSON, of few levels, without a key that an
/// object has twice (readers disagree which one counts). Its nodes are a hierarchy by
/// `findHierarchyError`; its meshes must not read the same data over and over; its extensions must
/// not be nested so deep that assimp, which copies them, does not end.
std::string findGltfError(const std::string& text);

/// Binary glTF: no chunk may be longer than the file, and the first is checked as glTF.
std::string findGlbError(const std::string& bytes);

/// XML: not too many levels, no declarations that could hide elements. The nodes of a Collada scene
/// are a hierarchy by `findHierarchyError`, those included that instance each other. A Collada text
/// is checked by `findColladaDataError` as well.
std::string findXmlError(const std::string& text);

/// Collada: arrays must have what accessors read of them, and lists of indices be numbers.
std::string findColladaDataError(const std::string& text);

/// \}

}  // namespace adaptive_bvh
