#pragma once

#include <array>
#include <cstdint>

#include <pybind11/numpy.h>

#include "bound.h"

namespace adaptive_bvh::python {

/// Python's SceneDistance. Numbers of bodies are -1 where there is no pair.
struct BodyGap : Bound {
  std::int64_t first, second;
  double distance;
  std::array<double, 6> points;
  std::array<std::int32_t, 2> triangles;
};

/// Pairs of bodies, and what was found for them. Python's SceneCollisions and others.
template <typename Found>
struct OfBodyPairs : Bound {
  py::array_t<std::int64_t> bodies, offsets;
  Found found;
};

}  // namespace adaptive_bvh::python
