#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bound.h"

namespace adaptive_bvh::python {

/// Pairs of bodies, and what was found for them. Python's SceneCollisions and others.
template <typename Found, typename Offset = std::size_t>
struct OfBodyPairs : Bound {
  std::vector<std::array<std::int64_t, 2>> bodies;
  std::vector<Offset> offsets;
  Found found;
};

}  // namespace adaptive_bvh::python
