#pragma once

#include "geometry/box.h"

namespace adaptive_bvh {

/// What a node hands to its parent in the post-order traversal.
struct NodeMotion {
  Box box;     ///< of its triangles, in body coordinates
  Box motion;  ///< of its vertices' VertexState::motion
};

}  // namespace adaptive_bvh
