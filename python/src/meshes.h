#pragma once

#include <string>

#include "adaptive_bvh/mesh.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// A path from Python as the system's calls want it. Throws what Python's open would.
std::string pathFrom(const py::object& path);

/// A mesh of (N, 3) positions and (M, 3) indices. Throws as Rows and trianglesFrom.
TriangleMesh meshFrom(const py::object& vertices, const py::object& faces);

}  // namespace adaptive_bvh::python
