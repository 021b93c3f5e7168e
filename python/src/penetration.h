#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "adaptive_bvh/penetration.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// Python's VertexContacts.
struct ContactArrays : Bound {
  py::array_t<std::int32_t> vertices, triangles;
  py::array_t<double> distances, positions, nearest_points, normals, barycentric, areas;
};
template <typename S>
ContactArrays contactArrays(VertexContacts<S>&& contacts);

void bindPenetration(py::module_& module);

}  // namespace adaptive_bvh::python
