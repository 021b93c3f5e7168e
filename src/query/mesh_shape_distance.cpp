#include "query/mesh_shape.h"

#include <fcl/narrowphase/detail/gjk_solver_indep.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_shape_distance_traversal_node.h>

#include "query/shape_visitor.h"

namespace adaptive_bvh {
namespace {

/// fcl::distance's enable_signed_distance for a mesh: the deepest of the contacts that a collision
/// query of one contact finds, negated.
template <typename S>
void replaceByPenetration(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                          const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                          const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                          const Recorder<S>& recorder) {
  fcl::CollisionRequest<S> contact_request;
  contact_request.enable_contact = true;
  contact_request.gjk_solver_type = request.gjk_solver_type;
  contact_request.gjk_tolerance = request.distance_tolerance;
  fcl::CollisionResult<S> contacts;
  if (meshShapeCollide(mesh, tf1, shape, tf2, contact_request, contacts, recorder) == 0) return;

  const fcl::Contact<S>* deepest = &contacts.getContact(0);
  for (std::size_t i = 1; i < contacts.numContacts(); ++i)
    if (contacts.getContact(i).penetration_depth > deepest->penetration_depth)
      deepest = &contacts.getContact(i);
  result.min_distance = -deepest->penetration_depth;
  if (request.enable_nearest_points)
    result.nearest_points[0] = result.nearest_points[1] = deepest->pos;
}

template <typename S, typename Solver>
S run(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
      const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2, const Solver& solver,
      const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
      const Recorder<S>& recorder) {
  return visitBoundedShape(shape, [&](const auto& typed_shape) -> S {
    using Shape = std::decay_t<decltype(typed_shape)>;
    using Node = fcl::detail::MeshShapeDistanceTraversalNodeRSS<Shape, Solver>;
    RecordingDistanceNode<Node, S> node(recorder);
    fcl::detail::initialize(static_cast<Node&>(node), mesh, tf1, typed_shape, tf2, &solver, request,
                            result);
    fcl::detail::distance(&node);
    return result.min_distance;
  });
}

}  // namespace

template <typename S>
S meshShapeDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& tf1,
                    const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
                    const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                    const Recorder<S>& recorder) {
  S found = result.min_distance;
  if (!request.isSatisfied(result)) {
    recorder.addQuery();
    if (request.gjk_solver_type == fcl::GST_LIBCCD) {
      fcl::detail::GJKSolver_libccd<S> solver;
      solver.distance_tolerance = request.distance_tolerance;
      found = run(mesh, tf1, shape, tf2, solver, request, result, recorder);
    } else {
      fcl::detail::GJKSolver_indep<S> solver;
      solver.gjk_tolerance = request.distance_tolerance;
      found = run(mesh, tf1, shape, tf2, solver, request, result, recorder);
    }
  }
  if (found != 0 && result.min_distance < 0 && request.enable_signed_distance)
    replaceByPenetration(mesh, tf1, shape, tf2, request, result, recorder);
  return found;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template S meshShapeDistance(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,  \
                               const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,   \
                               const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&,       \
                               const Recorder<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
