#pragma once

#include "adaptive_bvh/continuous_collision.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// Python's Impact.
struct FirstImpact : Bound {
  Impact impact;
};

/// Motion, candidates, time_of_impact, times_of_impact, earliest_impact, largest_safe_step,
/// safe_displacements.
void bindContinuous(py::module_& module);

}  // namespace adaptive_bvh::python
