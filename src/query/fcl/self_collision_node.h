#pragma once

#include "adaptive_bvh/self_collision.h"
#include "query/fcl/mesh_collision_node.h"
#include "volume/volume_separation.h"

namespace adaptive_bvh {

/// Volumes and triangles of one mesh against each other, all in its own frame, for FCL's
/// self-collision recursion.
template <typename BV>
class SelfCollisionNode : public MeshCollisionNode<BV> {
  using S = typename BV::S;

 public:
  SelfCollisionNode() {
    this->contacts_per_pair = 1;
    this->is_self = true;
  }

  NeighbourFilter filter = NeighbourFilter::SharedVertex;

  /// FCL's own test takes the distance of their rectangles, which may be too large where these are
  /// nearly parallel, as neighbours are.
  bool BVTesting(int b1, int b2) const override {
    const BV &a = this->model1->getBV(b1).bv, &b = this->model1->getBV(b2).bv;
    const VolumeSeparation<BV> separation(this->R, this->T, Volume<BV>::coordinateSum(a),
                                          Volume<BV>::coordinateSum(b));
    return separation(a, b, fcl::Vector3<S>::Zero(), S(0)) > 0;
  }

  void leafTesting(int b1, int b2) const override {
    if (!areNeighbours(b1, b2)) MeshCollisionNode<BV>::leafTesting(b1, b2);
  }

 private:
  bool areNeighbours(int leaf1, int leaf2) const {
    if (filter == NeighbourFilter::None) return false;
    const fcl::Triangle &a = this->tri_indices1[this->model1->getBV(leaf1).primitiveId()],
                        &b = this->tri_indices1[this->model1->getBV(leaf2).primitiveId()];
    int shared = 0;  // a vertex that a triangle repeats counts once
    for (int j = 0; j < 3; ++j) {
      const bool is_repeated = (j > 0 && b[j] == b[0]) || (j > 1 && b[j] == b[1]);
      shared += !is_repeated && (a[0] == b[j] || a[1] == b[j] || a[2] == b[j]);
    }
    return shared >= (filter == NeighbourFilter::SharedEdge ? 2 : 1);
  }
};

}  // namespace adaptive_bvh
