#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// signed_distances, winding_numbers, is_watertight, open_edges.
void bindInside(py::module_& module);

}  // namespace adaptive_bvh::python
