#include "query/fcl/mesh_shape.h"

#include <fcl/geometry/shape/utility.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision/shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "query/fcl/gjk_solver.h"
#include "query/fcl/recording_node.h"
#include "query/fcl/shape_visitor.h"
#include "query/placed_triangle.h"
#include "query/shape_search.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// FCL's traversal of a mesh with volumes of some type, and a shape.
template <typename BV, typename Shape, typename Solver>
struct FclShapeCollision;
template <typename S, typename Shape, typename Solver>
struct FclShapeCollision<fcl::RSS<S>, Shape, Solver> {
  using Node = fcl::detail::MeshShapeCollisionTraversalNodeRSS<Shape, Solver>;
};
template <typename S, typename Shape, typename Solver>
struct FclShapeCollision<fcl::OBBRSS<S>, Shape, Solver> {
  using Node = fcl::detail::MeshShapeCollisionTraversalNodeOBBRSS<Shape, Solver>;
};

template <typename BV, typename Shape, typename Solver>
class ShapeCollisionNode : public FclShapeCollision<BV, Shape, Solver>::Node {};

/// FCL reports that a sphere touches every triangle without a normal, at the sphere's middle. Here
/// the distance decides, and the contact is at the nearest point.
template <typename BV, typename S, typename Solver>
class ShapeCollisionNode<BV, fcl::Sphere<S>, Solver>
    : public FclShapeCollision<BV, fcl::Sphere<S>, Solver>::Node {
  using Base = typename FclShapeCollision<BV, fcl::Sphere<S>, Solver>::Node;

 public:
  using Base::leafTesting;
  void leafTesting(int b1, int b2) const override {
    const int triangle = this->model1->getBV(b1).primitiveId();
    const TrianglePoints<S> points = triangleInWorld(*this->model1, triangle, this->tf1);
    if (!isThin(points) || !this->model1->isOccupied() || !this->model2->isOccupied())
      return Base::leafTesting(b1, b2);
    const fcl::Vector3<S> center = this->tf2.translation(), nearest = nearestPoint(points, center);
    const S distance = (center - nearest).norm();
    if (distance > this->model2->radius) return;
    if (this->result->numContacts() < this->request.num_max_contacts) {
      const fcl::Vector3<S> normal =
          distance > 0 ? ((center - nearest) / distance).eval() : contactOf(points, points).normal;
      this->result->addContact(fcl::Contact<S>(  // the depth has FCL's sign
          this->model1, this->model2, triangle, fcl::Contact<S>::NONE, nearest, normal,
          distance - this->model2->radius));
    }
    if (this->request.enable_cost) addCost(points);
  }

 private:
  void addCost(const TrianglePoints<S>& points) const {
    fcl::AABB<S> sphere, common;
    fcl::computeBV(*this->model2, this->tf2, sphere);
    fcl::AABB<S>(points[0], points[1], points[2]).overlap(sphere, common);
    this->result->addCostSource(fcl::CostSource<S>(common, this->cost_density),
                                this->request.num_max_cost_sources);
  }
};

/// FCL's approximate cost: the mesh's root volume as a box against the shape. (FCL centres that box
/// on the rectangle's corner; kept, so that the field is FCL's.)
template <typename BV, typename Shape, typename Solver>
void addApproximateCost(const PlacedMesh<BV>& placed, const Shape& shape,
                        const fcl::Transform3<typename BV::S>& shape_tf, const Solver& solver,
                        const CollisionQuery<typename BV::S>& query) {
  using S = typename BV::S;
  const fcl::BVHModel<BV>& mesh = *placed.model;
  updateVolumes(placed);
  fcl::Box<S> box;
  fcl::Transform3<S> box_tf;
  fcl::constructBox(mesh.getBV(0).bv, placed.tf, box, box_tf);
  box.cost_density = mesh.cost_density;
  box.threshold_occupied = mesh.threshold_occupied;
  box.threshold_free = mesh.threshold_free;

  const fcl::CollisionRequest<S> cost_only(query.result.numContacts(), false,
                                           query.request.num_max_cost_sources, true, false);
  if (cost_only.isSatisfied(query.result)) return;
  solver.enableCachedGuess(true);
  fcl::detail::ShapeCollisionTraversalNode<fcl::Box<S>, Shape, Solver> node;
  fcl::detail::initialize(node, box, box_tf, shape, shape_tf, &solver, cost_only, query.result);
  fcl::detail::collide(&node);
}

/// False where FCL's traversal is to answer.
template <typename BV, typename Shape, typename Node>
bool collideByBoxes(const PlacedMesh<BV>& mesh, const Shape& shape,
                    const fcl::Transform3<typename BV::S>& shape_tf, Node& node) {
  if (!mesh.hasBoxes()) return false;
  ShapeSearch<BV> search(mesh, coreOf(shape), shape_tf);
  if (!search.isPossible()) return false;
  // FCL's solvers call what is nearer than their tolerance touching.
  search.collide(node, static_cast<double>(node.request.gjk_tolerance));
  node.addBoxTests(search.boxTests());
  return true;
}

}  // namespace

template <typename BV, typename Solver>
std::size_t meshShapeCollide(const PlacedMesh<BV>& mesh,
                             const PlacedGeometry<typename BV::S>& shape, const Solver& solver,
                             const CollisionQuery<typename BV::S>& query) {
  using S = typename BV::S;
  if (query.isSatisfied()) return query.result.numContacts();
  const bool approximate_cost = query.request.enable_cost && query.request.use_approximate_cost;
  fcl::CollisionRequest<S> mesh_request(query.request);
  mesh_request.enable_cost = query.request.enable_cost && !approximate_cost;

  return visitShape(*shape.geometry, [&](const auto& typed_shape) -> std::size_t {
    using Shape = std::decay_t<decltype(typed_shape)>;
    using Base = typename FclShapeCollision<BV, Shape, Solver>::Node;
    RecordingCollisionNode<ShapeCollisionNode<BV, Shape, Solver>, S> node(statisticsOf(mesh));
    fcl::detail::initialize(static_cast<Base&>(node), *mesh.model, mesh.tf, typed_shape, shape.tf,
                            &solver, mesh_request, query.result);
    if (!collideByBoxes(mesh, typed_shape, shape.tf, node)) {
      updateVolumes(mesh);
      fcl::detail::collide(&node);
    }
    if (approximate_cost) addApproximateCost(mesh, typed_shape, shape.tf, solver, query);
    return query.result.numContacts();
  });
}

template <typename BV>
std::size_t meshShapeCollide(const PlacedMesh<BV>& mesh,
                             const PlacedGeometry<typename BV::S>& shape,
                             const CollisionQuery<typename BV::S>& query) {
  return withSolver(query.request, [&](const auto& solver) {
    return meshShapeCollide(mesh, shape, solver, query);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE_SOLVER(BV, Solver)                                          \
  template std::size_t meshShapeCollide(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&, \
                                        const Solver&, const CollisionQuery<BV::S>&);
#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                         \
  template std::size_t meshShapeCollide(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&, \
                                        const CollisionQuery<BV::S>&);                       \
  ADAPTIVE_BVH_INSTANTIATE_SOLVER(BV, fcl::detail::GJKSolver_libccd<BV::S>)                  \
  ADAPTIVE_BVH_INSTANTIATE_SOLVER(BV, fcl::detail::GJKSolver_indep<BV::S>)
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE
#undef ADAPTIVE_BVH_INSTANTIATE_SOLVER

}  // namespace adaptive_bvh
