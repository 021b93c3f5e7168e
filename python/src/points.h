#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// closest_point, closest_points, first_hit, first_hits, ray_hits.
void bindPoints(py::module_& module);

}  // namespace adaptive_bvh::python
