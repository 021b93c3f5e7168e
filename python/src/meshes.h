#pragma once

#include <string>

#include "bound.h"

namespace adaptive_bvh::python {

/// A path from Python as the system's calls want it. Throws what Python's open would.
std::string pathFrom(const py::object& path);

/// Mesh, load_mesh, weld_vertices.
void bindMeshes(py::module_& module);

}  // namespace adaptive_bvh::python
