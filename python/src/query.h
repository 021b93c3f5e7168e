#pragma once

#include <array>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <fcl/narrowphase/contact.h>
#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/self_collision.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// Python's DistanceResult, in the order of the arguments.
struct Nearest : Bound {
  double distance = 0;
  std::array<double, 6> points = {};  ///< two points
  std::array<std::int32_t, 2> triangles = {};
};
/// Of two meshes.
Nearest nearestFrom(const fcl::DistanceResult<double>& result);
Nearest nearestFrom(const fcl::DistanceResult<float>& result);

/// Python's Contacts: arrays side by side.
struct Contacts : Bound {
  py::array_t<std::int32_t> pairs;
  py::array_t<double> points, normals, depths;
};

/// Contacts side by side, before they become arrays.
struct ContactLists {
  std::vector<int> triangles;
  std::vector<double> points, normals, depths;

  /// `is_swapped`: the contact's first object is the second of Python's.
  template <typename S>
  void add(const fcl::Contact<S>& contact, bool is_swapped);
  Contacts arrays() &&;
};

/// 'shared vertex', 'shared edge', 'beyond shared' or 'none'. Throws py::value_error.
NeighbourFilter neighbourFilter(const std::string& name);

/// distance, collide, self_collide and their results.
void bindQuery(py::module_& module);

}  // namespace adaptive_bvh::python
