#pragma once

#include <pybind11/pybind11.h>

#include <fcl/common/types.h>

namespace adaptive_bvh::python {

/// A pose from Python: None (the identity), a 4 x 4 array, or a pair of a 3 x 3 rotation and a
/// translation. Throws py::type_error on another type, py::value_error on another shape, on numbers
/// that are not finite, and where the rotation is none: R R^T must be the identity to 1e-6 and no
/// mirror. A rotation that is off by more than 1e-12, such as one of float32, is replaced by the
/// nearest one. `name` stands in the sentence. Needs the GIL.
fcl::Transform3d poseFrom(const pybind11::object& object, const char* name);

/// Throws std::invalid_argument when the translation is beyond what meshes of such numbers may
/// have.
void requireNear(const fcl::Transform3d& pose, bool is_double);

}  // namespace adaptive_bvh::python
