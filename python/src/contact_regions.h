#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// contact_regions, ContactTracker.
void bindContactRegions(py::module_& module);

}  // namespace adaptive_bvh::python
