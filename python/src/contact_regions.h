#pragma once

#include <string>

#include "bound.h"

namespace adaptive_bvh::python {

/// Triangles and begins, which Python may have changed, as the library makes them: a copy. Throws
/// py::value_error and py::index_error. `name` stands in the sentence.
ContactPatches checkedPatches(const ContactPatches& patches, const std::string& name);

}  // namespace adaptive_bvh::python
