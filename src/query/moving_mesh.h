#pragma once

#include <vector>

#include "boxes/feature_leaves.h"

namespace adaptive_bvh {

/// A mesh whose vertices move on straight lines in the world: what a query between two frames
/// reads, whatever the mesh's numbers are. Owns nothing.
struct MovingMesh {
  const WideNode* nodes;  ///< links only; boxes are not read
  const Int4* vertices;   ///< of triangles, by place in the order of the leaves
  const VertexSlots* slots;
  const FeatureOwners* owners;
  const FeatureLeaves* features;
  const fcl::Vector3d *start, *end;  ///< by vertex
  const fcl::Triangle* triangles;    ///< by index
  unsigned num_vertices, num_triangles;
  int num_nodes, depth;
  double error;  ///< how far a position may be from the exact one
};

}  // namespace adaptive_bvh
