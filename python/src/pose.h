#pragma once

#include <pybind11/pybind11.h>

#include <fcl/common/types.h>

namespace adaptive_bvh::python {

/// A pose from Python: None (the identity), a 4 x 4 array, or a pair of a 3 x 3 rotation and a
/// translation. Throws py::type_error on another type, py::value_error on another shape, on numbers
/// that are not finite, and where the rotation is none: R R^T must be the identity to 1e-6 and no
/// mirror. A rotation that is off by more than 1e-12, such as one of float32, is replaced by the
/// nearest one. Throws std::invalid_argument
/// when it moves a mesh farther than a mesh may be. `name` stands in the sentence. Needs the GIL.
fcl::Transform3d poseFrom(const pybind11::object& object, const char* name);

/// Two poses, read before the GIL is released.
struct Poses {
  Poses(const pybind11::object& first, const pybind11::object& second, const char* name1 = "tf1",
        const char* name2 = "tf2")
      : tf1(poseFrom(first, name1)), tf2(poseFrom(second, name2)) {}
  fcl::Transform3d tf1, tf2;
};

}  // namespace adaptive_bvh::python
