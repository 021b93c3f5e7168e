#include "query/fcl/mesh_shape.h"

#include <algorithm>
#include <limits>

#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_shape_distance_traversal_node.h>

#include "query/fcl/gjk_solver.h"
#include "query/fcl/recording_node.h"
#include "query/fcl/shape_triangle.h"
#include "query/fcl/shape_visitor.h"
#include "query/shape_search.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// FCL's traversal of a mesh with volumes of some type, and a shape.
template <typename BV, typename Shape, typename Solver>
struct FclShapeDistance;
template <typename S, typename Shape, typename Solver>
struct FclShapeDistance<fcl::RSS<S>, Shape, Solver> {
  using Node = fcl::detail::MeshShapeDistanceTraversalNodeRSS<Shape, Solver>;
};
template <typename S, typename Shape, typename Solver>
struct FclShapeDistance<fcl::OBBRSS<S>, Shape, Solver> {
  using Node = fcl::detail::MeshShapeDistanceTraversalNodeOBBRSS<Shape, Solver>;
};

/// That traversal, with nearest points in the world for every shape, and none when it touches.
template <typename BV, typename Shape, typename Solver>
class ShapeDistanceNode : public FclShapeDistance<BV, Shape, Solver>::Node {
 public:
  int first_triangle = 0;  ///< whose distance is the first bound

  void preprocess() override { test(first_triangle); }
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
template <typename BV, typename Solver>
void replaceByPenetration(const PlacedMesh<BV>& mesh, const PlacedGeometry<typename BV::S>& shape,
                          const Solver& solver, const DistanceQuery<typename BV::S>& query) {
  using S = typename BV::S;
  const fcl::CollisionRequest<S> with_contact(1, true);
  fcl::CollisionResult<S> contacts;
  meshShapeCollide<BV>(mesh, shape, solver, {with_contact, contacts});

  S depth = std::numeric_limits<S>::min();
  const fcl::Contact<S>* deepest = nullptr;
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    const fcl::Contact<S>& contact = contacts.getContact(i);
    if (!deepest || contact.penetration_depth > depth) deepest = &contact;
    depth = std::max(depth, contact.penetration_depth);
  }
  query.result.min_distance = -depth;
  if (query.request.enable_nearest_points && deepest)
    query.result.nearest_points[0] = query.result.nearest_points[1] = deepest->pos;
}

/// False where FCL's traversal is to answer.
template <typename BV, typename Shape, typename Node>
bool distanceByBoxes(const PlacedMesh<BV>& mesh, const Shape& shape,
                     const fcl::Transform3<typename BV::S>& shape_tf,
                     const DistanceQuery<typename BV::S>& query, Node& node) {
  if (!mesh.hasBoxes()) return false;
  ShapeSearch<BV> search(mesh, coreOf(shape), shape_tf);
  if (!search.isPossible()) return false;
  node.preprocess();
  search.distance(node, query);
  node.postprocess();
  node.addBoxTests(search.boxTests());
  return true;
}

template <typename BV, typename Solver>
typename BV::S run(const PlacedMesh<BV>& mesh, const PlacedGeometry<typename BV::S>& shape,
                   const Solver& solver, const DistanceQuery<typename BV::S>& query) {
  using S = typename BV::S;
  if (query.isSatisfied()) return query.result.min_distance;
  visitBoundedShape(*shape.geometry, [&](const auto& typed_shape) {
    using Shape = std::decay_t<decltype(typed_shape)>;
    using Base = typename FclShapeDistance<BV, Shape, Solver>::Node;
    RecordingDistanceNode<ShapeDistanceNode<BV, Shape, Solver>, S> node(statisticsOf(mesh));
    fcl::detail::initialize(static_cast<Base&>(node), *mesh.model, mesh.tf, typed_shape, shape.tf,
                            &solver, query.request, query.result);
    WitnessCache* const witnesses = mesh.tree ? &mesh.tree->witnesses : nullptr;
    if (witnesses) {
      const unsigned last = witnesses->recall(shape.geometry).first;
      node.first_triangle = last < unsigned(mesh.model->num_tris) ? int(last) : 0;
    }
    if (!distanceByBoxes(mesh, typed_shape, shape.tf, query, node)) {
      updateVolumes(mesh);
      fcl::detail::distance(&node);
    }
    if (witnesses && query.result.o1 == mesh.model && query.result.b1 >= 0)
      witnesses->keep(shape.geometry, {unsigned(query.result.b1), 0, false});
  });
  const S found = query.result.min_distance;
  if (found < 0 && query.request.enable_signed_distance)
    replaceByPenetration(mesh, shape, solver, query);
  return found;
}

}  // namespace

template <typename BV>
typename BV::S meshShapeDistance(const PlacedMesh<BV>& mesh,
                                 const PlacedGeometry<typename BV::S>& shape,
                                 const DistanceQuery<typename BV::S>& query) {
  return withSolver(query.request,
                    [&](const auto& solver) { return run(mesh, shape, solver, query); });
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template BV::S meshShapeDistance(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&, \
                                   const DistanceQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
