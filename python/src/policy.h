#pragma once

#include "bound.h"

namespace adaptive_bvh::python {

/// RefitPolicy and UpdateReport.
void bindPolicy(py::module_& module);

}  // namespace adaptive_bvh::python
