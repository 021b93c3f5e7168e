#pragma once

#include <array>
#include <vector>

#include <fcl/narrowphase/contact.h>
#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/scene.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// Python's DistanceResult, in the order of the arguments.
struct Nearest : Bound {
  Nearest() = default;
  /// `is_swapped`: the result's first object is the second of Python's.
  explicit Nearest(const fcl::DistanceResultd& result, bool is_swapped = false);
  explicit Nearest(const SceneDistance& result)
      : distance(result.distance), points(result.points), triangles(result.elements) {}

  double distance = 0;
  std::array<fcl::Vector3d, 2> points;
  std::array<int, 2> triangles = {};
};

/// Python's Contacts, side by side.
struct Contacts : Bound {
  std::vector<std::array<int, 2>> pairs;
  std::vector<fcl::Vector3d> points, normals;
  std::vector<double> depths;
  bool reached_limit = false;  ///< there may be more: the search ended at the request's limit

  /// `is_swapped`: the contact's first object is the second of Python's.
  void add(const fcl::Contactd& contact, bool is_swapped);
};

}  // namespace adaptive_bvh::python
