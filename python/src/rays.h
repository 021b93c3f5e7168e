#pragma once

#include "arrays.h"

namespace adaptive_bvh::python {

/// N rays; one of (3,) numbers is a list of one. Throws as Rows, and py::value_error when there are
/// not as many directions as origins.
struct RayArguments {
  RayArguments(const py::object& from, const py::object& along);

  Rows origins, directions;
};

}  // namespace adaptive_bvh::python
