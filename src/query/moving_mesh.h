#pragma once

#include <vector>

#include "tree/feature_owners.h"
#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// A mesh whose vertices move on straight lines in the world: what a query between two frames
/// reads, whatever the model's volumes and numbers are. Owns nothing.
struct MovingMesh {
  const WideNode* nodes;  ///< links only; boxes are not read
  const Int4* vertices;   ///< of triangles, by place in the order of FCL's leaves
  const VertexSlots* slots;
  const FeatureOwners* owners;
  const fcl::Vector3d *start, *end;  ///< by vertex
  const fcl::Triangle* triangles;    ///< by FCL's number
  unsigned num_vertices, num_triangles;
  int num_nodes, depth;
  double error;  ///< how far a position may be from the exact one

  std::array<unsigned, 2> edge(unsigned place, unsigned k) const {
    const Int4& v = vertices[place];
    return {static_cast<unsigned>(v[int(k)]), static_cast<unsigned>(v[int(k + 1) % 3])};
  }
};

}  // namespace adaptive_bvh
