#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// vertex_contacts, signed_distance, signed_distances, winding_numbers, is_watertight.
void bindPenetration(py::module_& module);

}  // namespace adaptive_bvh::python
