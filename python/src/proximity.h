#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// is_nearer, pairs_within, feature_pairs_within, clearance, signed_clearance.
void bindProximity(py::module_& module);

}  // namespace adaptive_bvh::python
