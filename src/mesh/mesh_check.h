#pragma once

#include <string>

#include "mesh/mesh_state.h"

namespace adaptive_bvh {

/// DeformableMesh::validate.
template <typename S>
bool checkMesh(const MeshState<S>& state, std::string* reason);

}  // namespace adaptive_bvh
