#pragma once

#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>

#include "fcl/placed_model.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// FCL's traversal of two meshes with volumes of one type.
template <typename BV>
struct FclMeshCollision;
template <typename S>
struct FclMeshCollision<fcl::RSS<S>> {
  using Node = fcl::detail::MeshCollisionTraversalNodeRSS<S>;
};
template <typename S>
struct FclMeshCollision<fcl::OBBRSS<S>> {
  using Node = fcl::detail::MeshCollisionTraversalNodeOBBRSS<S>;
};

/// That traversal, with a test of two triangles of our own (addContactsOf).
template <typename BV>
class MeshCollisionNode : public FclMeshCollision<BV>::Node {
  using S = typename BV::S;
  using Base = typename FclMeshCollision<BV>::Node;

 public:
  void initialize(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                  const CollisionQuery<S>& query) {
    fcl::detail::initialize(static_cast<Base&>(*this), *first.model, first.tf, *second.model,
                            second.tf, query.request, query.result);
    to_first_ = RelativePlacement(first.tf, second.tf);
    this->R = to_first_.R.template cast<S>();
    this->T = to_first_.T.template cast<S>();
  }

  void leafTesting(int b1, int b2) const override {
    addContactsOf<S>({this->model1, viewOf(*this->model1), this->tf1},
                     {this->model2, viewOf(*this->model2), this->tf2}, to_first_,
                     this->model1->getBV(b1).primitiveId(), this->model2->getBV(b2).primitiveId(),
                     false, 2, this->request, *this->result);
  }

 private:
  RelativePlacement to_first_;
};

}  // namespace adaptive_bvh
