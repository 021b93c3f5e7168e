#pragma once

#include <pybind11/pybind11.h>

namespace adaptive_bvh::python {

/// Recording. Without the component its constructor says what is missing.
void bindRecording(pybind11::module_& module);

}  // namespace adaptive_bvh::python
