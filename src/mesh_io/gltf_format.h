#pragma once

#include <string>

namespace adaptive_bvh {

/// What is wrong with the JSON text of a glTF file (version 1 or 2; of a GLB its JSON chunk) before
/// assimp may read it; empty when nothing is. The text must be JSON, of few levels, without a key
/// that an object has twice (readers disagree which one counts). Its nodes are a hierarchy by
/// `findHierarchyError`; its meshes must not read the same data over and over; its extensions must
/// not be nested so deep that assimp, which copies them, does not end.
std::string findGltfError(const std::string& text);

}  // namespace adaptive_bvh
