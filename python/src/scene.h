#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// Scene and its results.
void bindScene(py::module_& module);

}  // namespace adaptive_bvh::python
