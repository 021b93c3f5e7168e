#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// closest_point, closest_points, closest_features and their results.
void bindPoints(py::module_& module);

}  // namespace adaptive_bvh::python
