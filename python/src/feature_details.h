#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// feature_pair_details and its results.
void bindFeatureDetails(py::module_& module);

}  // namespace adaptive_bvh::python
