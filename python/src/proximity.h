#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "adaptive_bvh/proximity.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// Python's TrianglePairs.
struct NearPairs : Bound {
  py::array_t<std::int32_t> triangles;
  py::array_t<double> distances, nearest_points;
};
template <typename S>
NearPairs nearPairs(TrianglePairs<S>&& pairs);

/// is_nearer, pairs_within, feature_pairs_within, clearance and their results.
void bindProximity(py::module_& module);

}  // namespace adaptive_bvh::python
