#pragma once

#include <pybind11/numpy.h>

#include "bound.h"

namespace adaptive_bvh::python {

/// Python's ContactPatches.
struct PatchArrays : Bound {
  py::array_t<double> areas, centroids;
  py::array_t<std::int32_t> triangles;
  py::array_t<std::int64_t> begins;
};

/// contact_regions, ContactTracker.
void bindContactRegions(py::module_& module);

}  // namespace adaptive_bvh::python
