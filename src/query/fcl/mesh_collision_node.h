#pragma once

#include <limits>
#include <utility>

#include <fcl/math/bv/AABB.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>

#include "geometry/mesh_of_model.h"
#include "geometry/rigid.h"
#include "geometry/triangle_gap.h"
#include "query/placed_mesh.h"
#include "query/unset_fields.h"

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

/// That traversal, with a test of two triangles of our own: those touch whose distance is 0, and
/// every such pair has a contact, with all its fields when they are requested. (FCL decides by the
/// signs of rounded numbers. When a triangle is a segment or a point, it reads a plane that it did
/// not set.)
template <typename BV>
class MeshCollisionNode : public FclMeshCollision<BV>::Node {
  using S = typename BV::S;
  using Base = typename FclMeshCollision<BV>::Node;

 public:
  unsigned contacts_per_pair = 2;  ///< at most; FCL has up to 2
  /// Both meshes are the same in the same place: the triangle with the smaller index is tested as
  /// the first. FCL's contact may depend on that.
  bool is_self = false;

  void initialize(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                  const CollisionQuery<S>& query) {
    fcl::detail::initialize(static_cast<Base&>(*this), *first.model, first.tf, *second.model,
                            second.tf, query.request, query.result);
    to_first_ = is_self ? RelativePlacement() : RelativePlacement(first.tf, second.tf);
    this->R = to_first_.R.template cast<S>();
    this->T = to_first_.T.template cast<S>();
  }

  void leafTesting(int b1, int b2) const override {
    testTriangles(this->model1->getBV(b1).primitiveId(), this->model2->getBV(b2).primitiveId(),
                  false);
  }

  /// Adds the contacts of two triangles. `touching`: they are known to touch, neither is thin.
  void testTriangles(int id1, int id2, bool touching) const {
    const bool occupied = this->model1->isOccupied() && this->model2->isOccupied();
    if (!occupied && !hasCost()) return;
    if (is_self && id2 < id1) std::swap(id1, id2);
    if (touching && occupied && !this->request.enable_contact && !this->request.enable_cost)
      return addPair(id1, id2);
    const TrianglePoints<S> first = pointsOf(*this->model1, id1);
    const TrianglePoints<S> second = pointsOf(*this->model2, id2);
    const TrianglePoints<double> in_first = {to_first_(second[0]), to_first_(second[1]),
                                             to_first_(second[2])};
    if (!touching && !touch(pointsAs<double>(first), in_first)) return;
    if (occupied && this->request.enable_contact)
      addContacts(id1, id2, contactOf(first, pointsAs<S>(in_first)));
    else if (occupied)
      addPair(id1, id2);
    if (this->request.enable_cost) addCost(first, second);
  }

 private:
  /// Of objects that may be there, as of those that are.
  bool hasCost() const {
    return this->request.enable_cost && !this->model1->isFree() && !this->model2->isFree();
  }

  static TrianglePoints<S> pointsOf(const fcl::BVHModel<BV>& model, int id) {
    const VertexIndices t = viewOf(model).verticesOf(static_cast<unsigned>(id));
    return {model.vertices[t[0]], model.vertices[t[1]], model.vertices[t[2]]};
  }

  bool hasRoom() const { return this->result->numContacts() < this->request.num_max_contacts; }

  void addPair(int id1, int id2) const {
    if (hasRoom())
      this->result->addContact(fcl::Contact<S>(this->model1, this->model2, id1, id2,
                                               unsetPoint<S>(), unsetPoint<S>(),
                                               std::numeric_limits<S>::quiet_NaN()));
  }

  void addContacts(int id1, int id2, const TriangleContact<S>& contact) const {
    for (unsigned i = 0; i < contact.count && i < contacts_per_pair && hasRoom(); ++i)
      this->result->addContact(fcl::Contact<S>(this->model1, this->model2, id1, id2,
                                               this->tf1 * contact.points[i],
                                               this->tf1.linear() * contact.normal, contact.depth));
  }

  void addCost(const TrianglePoints<S>& first, const TrianglePoints<S>& second) const {
    const auto boxOf = [](const fcl::Transform3<S>& tf, const TrianglePoints<S>& t) {
      return fcl::AABB<S>(tf * t[0], tf * t[1], tf * t[2]);
    };
    fcl::AABB<S> common;
    boxOf(this->tf1, first).overlap(boxOf(this->tf2, second), common);
    this->result->addCostSource(fcl::CostSource<S>(common, this->cost_density),
                                this->request.num_max_cost_sources);
  }

  RelativePlacement to_first_;
};

}  // namespace adaptive_bvh
