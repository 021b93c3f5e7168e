#pragma once

#include <string>

namespace adaptive_bvh {

/// What is wrong with a file that assimp cannot be given as it is; empty when nothing is, or the
/// format is another. Readers allocate and loop by what a header announces before they look whether
/// it is there, so that a few bytes can take all memory, or all time:
/// - PLY: header and body are walked through; every element must be there.
/// - STL, as text: facets of three vertices, all numbers; assimp would leak what it has read.
/// - OFF: no count may exceed the number of bytes.
/// - XML: its elements must not be nested too deep (xml_format.h).
/// - Collada: arrays must have what accessors read of them, and lists of indices be numbers; nodes
///   must not instance each other without end.
/// - glTF: nodes must not name each other without end (gltf_format.h).
/// - GLB: no chunk may be longer than the file.
std::string objectionTo(const std::string& path);

}  // namespace adaptive_bvh
