#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// Mesh, load_mesh, weld_vertices.
void bindMeshes(py::module_& module);

}  // namespace adaptive_bvh::python
