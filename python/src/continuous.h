#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// Motion, candidates, time_of_impact, times_of_impact, earliest_impact, largest_safe_step,
/// safe_displacements.
void bindContinuous(py::module_& module);

}  // namespace adaptive_bvh::python
