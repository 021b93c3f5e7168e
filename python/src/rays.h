#pragma once

#include "arrays.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// N rays; one of (3,) numbers is a list of one. Throws as rowsFrom, and py::value_error when there
/// are not as many directions as origins.
template <typename S>
struct Rays {
  Rays(const py::object& from, const py::object& along);
  std::size_t size() const { return static_cast<std::size_t>(origins.shape(0)); }

  Rows<S> origins, directions;
};

/// first_hit, any_hit, ray_hits and their results.
void bindRays(py::module_& module);

}  // namespace adaptive_bvh::python
