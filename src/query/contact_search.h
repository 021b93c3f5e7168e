#pragma once

#include "query/candidate_tests.h"
#include "query/fcl/mesh_collision_node.h"
#include "query/triangle_search.h"

namespace adaptive_bvh {

/// The test of two triangles, which adds their contacts.
template <typename BV>
struct ContactNode : MeshCollisionNode<BV> {
  void test(int triangle1, int triangle2) const {
    this->testTriangles(triangle1, triangle2, false);
  }
  void add(int triangle1, int triangle2) const { this->testTriangles(triangle1, triangle2, true); }
  bool isDone() const { return this->canStop(); }
};

/// Its output is a ContactNode, which takes the contacts; R and T of the input are the node's.
template <bool kIsSelf, typename BV, typename Frame>
using ContactSearch = TriangleSearch<kIsSelf, BV, CandidateTests<BV, Frame, const ContactNode<BV>>>;

}  // namespace adaptive_bvh
