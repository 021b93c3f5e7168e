#include "query/mesh_shape.h"

#include <algorithm>
#include <limits>

#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_shape_distance_traversal_node.h>

#include "query/gjk_solver.h"
#include "query/shape_triangle.h"
#include "query/shape_visitor.h"

namespace adaptive_bvh {
namespace {

/// FCL's traversal, with points in the world for every shape, and none of a shape that touches.
template <typename Shape, typename Solver>
class ShapeDistanceNode : public fcl::detail::MeshShapeDistanceTraversalNodeRSS<Shape, Solver> {
 public:
  void preprocess() override { test(0); }
  void leafTesting(int b1, int) const override { test(this->model1->getBV(b1).primitiveId()); }

 private:
  void test(int triangle) const {
    using S = typename Shape::S;
    const ShapeTriangleDistance<S> found = shapeTriangleDistance(
        *this->nsolver, *this->model2, this->tf2, *this->model1, this->tf1, triangle);
    this->result->update(found.distance, this->model1, this->model2, triangle,
                         fcl::DistanceResult<S>::NONE, found.on_triangle, found.on_shape);
  }
};

/// What fcl::distance does for enable_signed_distance: the deepest contact of a collision query, as
/// a negative distance. Where none has a positive depth FCL answers with the least positive number,
/// negated, and the last contact's position.
template <typename S, typename Solver>
void replaceByPenetration(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                          const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                          const Solver& solver, const fcl::DistanceRequest<S>& request,
                          fcl::DistanceResult<S>& result, const Recorder& recorder) {
  const fcl::CollisionRequest<S> with_contact(1, true);
  fcl::CollisionResult<S> contacts;
  meshShapeCollide(mesh, tf1, shape, tf2, solver, with_contact, contacts, recorder);

  S depth = std::numeric_limits<S>::min();
  const fcl::Contact<S>* deepest = nullptr;
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    const fcl::Contact<S>& contact = contacts.getContact(i);
    if (!deepest || contact.penetration_depth > depth) deepest = &contact;
    depth = std::max(depth, contact.penetration_depth);
  }
  result.min_distance = -depth;
  if (request.enable_nearest_points && deepest)
    result.nearest_points[0] = result.nearest_points[1] = deepest->pos;
}

template <typename S, typename Solver>
S run(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
      const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2, const Solver& solver,
      const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
      const Recorder& recorder) {
  if (request.isSatisfied(result)) return result.min_distance;
  visitBoundedShape(shape, [&](const auto& typed_shape) {
    using Shape = std::decay_t<decltype(typed_shape)>;
    using Base = fcl::detail::MeshShapeDistanceTraversalNodeRSS<Shape, Solver>;
    RecordingDistanceNode<ShapeDistanceNode<Shape, Solver>, S> node(recorder);
    fcl::detail::initialize(static_cast<Base&>(node), mesh, tf1, typed_shape, tf2, &solver, request,
                            result);
    fcl::detail::distance(&node);
  });
  const S found = result.min_distance;
  if (found < 0 && request.enable_signed_distance)
    replaceByPenetration(mesh, tf1, shape, tf2, solver, request, result, recorder);
  return found;
}

}  // namespace

template <typename S>
S meshShapeDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                    const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                    const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                    const Recorder& recorder) {
  return withSolver(request, [&](const auto& solver) {
    return run(mesh, tf1, shape, tf2, solver, request, result, recorder);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                          \
  template S meshShapeDistance(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&, \
                               const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,  \
                               const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&,      \
                               const Recorder&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
