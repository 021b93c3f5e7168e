#include "query/mesh_shape.h"

#include <fcl/geometry/shape/utility.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision/shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "query/gjk_solver.h"
#include "query/shape_triangle.h"
#include "query/shape_visitor.h"

namespace adaptive_bvh {
namespace {

template <typename Shape, typename Solver>
class ShapeCollisionNode : public fcl::detail::MeshShapeCollisionTraversalNodeRSS<Shape, Solver> {};

/// To FCL every sphere touches every triangle without a normal, at the sphere's middle. Here the
/// distance decides, and the contact is at the nearest point.
template <typename S, typename Solver>
class ShapeCollisionNode<fcl::Sphere<S>, Solver>
    : public fcl::detail::MeshShapeCollisionTraversalNodeRSS<fcl::Sphere<S>, Solver> {
  using Base = fcl::detail::MeshShapeCollisionTraversalNodeRSS<fcl::Sphere<S>, Solver>;

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
template <typename S, typename Shape, typename Solver>
void addApproximateCost(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                        const Shape& shape, const fcl::Transform3<S>& tf2, const Solver& solver,
                        const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result) {
  fcl::Box<S> box;
  fcl::Transform3<S> box_tf;
  fcl::constructBox(mesh.getBV(0).bv, tf1, box, box_tf);
  box.cost_density = mesh.cost_density;
  box.threshold_occupied = mesh.threshold_occupied;
  box.threshold_free = mesh.threshold_free;

  const fcl::CollisionRequest<S> cost_only(result.numContacts(), false,
                                           request.num_max_cost_sources, true, false);
  if (cost_only.isSatisfied(result)) return;
  solver.enableCachedGuess(true);
  fcl::detail::ShapeCollisionTraversalNode<fcl::Box<S>, Shape, Solver> node;
  fcl::detail::initialize(node, box, box_tf, shape, tf2, &solver, cost_only, result);
  fcl::detail::collide(&node);
}

}  // namespace

template <typename S, typename Solver>
std::size_t meshShapeCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                             const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                             const Solver& solver, const fcl::CollisionRequest<S>& request,
                             fcl::CollisionResult<S>& result, const Recorder& recorder) {
  if (request.isSatisfied(result)) return result.numContacts();
  const bool approximate_cost = request.enable_cost && request.use_approximate_cost;
  fcl::CollisionRequest<S> mesh_request(request);
  mesh_request.enable_cost = request.enable_cost && !approximate_cost;

  return visitShape(shape, [&](const auto& typed_shape) -> std::size_t {
    using Shape = std::decay_t<decltype(typed_shape)>;
    using Base = fcl::detail::MeshShapeCollisionTraversalNodeRSS<Shape, Solver>;
    RecordingCollisionNode<ShapeCollisionNode<Shape, Solver>, S> node(recorder);
    fcl::detail::initialize(static_cast<Base&>(node), mesh, tf1, typed_shape, tf2, &solver,
                            mesh_request, result);
    fcl::detail::collide(&node);
    if (approximate_cost) addApproximateCost(mesh, tf1, typed_shape, tf2, solver, request, result);
    return result.numContacts();
  });
}

template <typename S>
std::size_t meshShapeCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                             const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                             const fcl::CollisionRequest<S>& request,
                             fcl::CollisionResult<S>& result, const Recorder& recorder) {
  return withSolver(request, [&](const auto& solver) {
    return meshShapeCollide(mesh, tf1, shape, tf2, solver, request, result, recorder);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE_SOLVER(S, Solver)                                \
  template std::size_t meshShapeCollide(                                          \
      const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,               \
      const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, const Solver&, \
      const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, const Recorder&);
#define ADAPTIVE_BVH_INSTANTIATE(S)                                                \
  template std::size_t meshShapeCollide(                                           \
      const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,                \
      const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,                 \
      const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, const Recorder&); \
  ADAPTIVE_BVH_INSTANTIATE_SOLVER(S, fcl::detail::GJKSolver_libccd<S>)             \
  ADAPTIVE_BVH_INSTANTIATE_SOLVER(S, fcl::detail::GJKSolver_indep<S>)
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE
#undef ADAPTIVE_BVH_INSTANTIATE_SOLVER

}  // namespace adaptive_bvh
