#pragma once

#include <string>

#include "adaptive_bvh/mesh.h"
#include "motion.h"

namespace tools {

/// Two bodies, and how they move.
struct MovingPair {
  const adaptive_bvh::TriangleMesh &a, &b;
  Motion &motion_a, &motion_b;
  int frames;
};

/// Takes the pair through its frames once more, with adaptive_bvh::distance on AdaptiveBVHModels of
/// BV, records that as a page, and prints where it is and what recording has cost. Prints that
/// there is no page where the library was built without the component recording. Throws
/// std::runtime_error when the file cannot be written.
template <typename BV>
void writePage(const MovingPair& pair, const std::string& path);

}  // namespace tools
