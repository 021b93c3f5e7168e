#include "fcl/mesh_pairs.h"

#include <cmath>
#include <limits>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/utility.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_shape_distance_traversal_node.h>

#include "adaptive_bvh/proximity.h"
#include "base/rigid.h"
#include "fcl/shape_geometry.h"
#include "fcl/shape_results.h"
#include "fcl/shape_search.h"
#include "query/closed_surface.h"
#include "query/placed_mesh.h"
#include "thesis/recording_node.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {
namespace {

/// FCL's traversals are compiled for a solver; the triangles of ours are not tested by it.
struct NoSolver {
  template <typename... Args>
  bool shapeTriangleIntersect(const Args&...) const {
    return false;
  }
  template <typename... Args>
  bool shapeTriangleDistance(const Args&...) const {
    return false;
  }
};

/// FCL's traversals of a mesh with volumes of some type, and a box.
template <typename BV>
struct FclBoxTraversal;
template <typename S>
struct FclBoxTraversal<fcl::RSS<S>> {
  using Collision = fcl::detail::MeshShapeCollisionTraversalNodeRSS<fcl::Box<S>, NoSolver>;
  using Distance = fcl::detail::MeshShapeDistanceTraversalNodeRSS<fcl::Box<S>, NoSolver>;
};
template <typename S>
struct FclBoxTraversal<fcl::OBBRSS<S>> {
  using Collision = fcl::detail::MeshShapeCollisionTraversalNodeOBBRSS<fcl::Box<S>, NoSolver>;
  using Distance = fcl::detail::MeshShapeDistanceTraversalNodeOBBRSS<fcl::Box<S>, NoSolver>;
};

/// Hands the triangles that FCL's traversal reaches to test(triangle), until it returns true.
template <typename BV, typename Test>
class TouchingNode : public FclBoxTraversal<BV>::Collision {
 public:
  const Test* test = nullptr;

  bool canStop() const override { return is_done_; }
  void leafTesting(int leaf, int) const override {
    is_done_ = (*test)(this->model1->getBV(leaf).primitiveId());
  }

 private:
  mutable bool is_done_ = false;
};
template <typename BV, typename Test>
class NearestNode : public FclBoxTraversal<BV>::Distance {
 public:
  const Test* test = nullptr;

  void preprocess() override { is_done_ = (*test)(0); }
  bool canStop(typename BV::S bound) const override {
    return is_done_ || FclBoxTraversal<BV>::Distance::canStop(bound);
  }
  void leafTesting(int leaf, int) const override {
    is_done_ = is_done_ || (*test)(this->model1->getBV(leaf).primitiveId());
  }

 private:
  mutable bool is_done_ = false;
};

/// A model and a shape in their places, by FCL's traversal of the model and the box around the
/// shape. A plane and a half-space have no such box: every triangle is tested.
template <typename BV>
class ModelShapeSearch {
 public:
  using S = typename BV::S;

  ModelShapeSearch(const PlacedModel<BV>& model, const TriangleShape& shape, const ShapeCore& core,
                   const fcl::Transform3<S>& shape_tf)
      : triangles(model.triangles(), model.numTriangles(), shape, shape_tf),
        model_(model),
        core_(core),
        shape_tf_(shape_tf) {}

  const ShapeTriangles<S> triangles;

  /// Calls test(triangle) for all that may touch the shape, until it returns true.
  template <typename Test>
  void touching(const Test& test) const {
    if (!core_.isBounded()) return testAll(test);
    using Node = TouchingNode<BV, Test>;
    RecordingCollisionNode<Node, S> node(statisticsOf(model_));
    fcl::CollisionResult<S> unused;
    initialize(static_cast<typename FclBoxTraversal<BV>::Collision&>(node),
               fcl::CollisionRequest<S>(), unused, [&] {
                 node.test = &test;
                 fcl::detail::collide(&node);
               });
  }

  /// Calls test(triangle) for all that may be nearer to the shape than query.result, the nearest
  /// first, until it returns true. The test updates that result.
  template <typename Test>
  void nearest(const DistanceQuery<S>& query, const PointPair<double>&, const Test& test) const {
    if (!core_.isBounded()) return testAll(test);
    using Node = NearestNode<BV, Test>;
    RecordingDistanceNode<Node, S> node(statisticsOf(model_));
    initialize(static_cast<typename FclBoxTraversal<BV>::Distance&>(node), query.request,
               query.result, [&] {
                 node.test = &test;
                 fcl::detail::distance(&node);
               });
  }

  /// Box of the whole model, for FCL's approximate cost: its root volume. (FCL centres that box on
  /// the rectangle's corner; kept, so that the cost is FCL's.)
  void boxAround(fcl::Box<S>& box, fcl::Transform3<S>& box_tf) const {
    fcl::constructBox(model_.model->getBV(0).bv, model_.tf, box, box_tf);
  }

 private:
  template <typename Test>
  void testAll(const Test& test) const {
    QueryWork work;
    for (int i = 0; i < model_.numTriangles(); ++i) {
      ++work.leaf_tests;
      if (test(i)) break;
    }
    statisticsOf(model_).recordQuery(work);
  }

  template <typename Node, typename Request, typename Result, typename Run>
  void initialize(Node& node, const Request& request, Result& result, const Run& run) const {
    const fcl::Vector3d half = (core_.high - core_.low) / 2 + fcl::Vector3d::Constant(core_.radius);
    const fcl::Box<S> box(fcl::Vector3<S>((2 * half).template cast<S>()));
    fcl::Transform3<S> box_tf = shape_tf_;
    box_tf.translation() = triangles.inWorld((core_.low + core_.high) / 2);
    const NoSolver solver;
    fcl::detail::initialize(node, *model_.model, model_.tf, box, box_tf, &solver, request, result);
    run();
  }

  const PlacedModel<BV>& model_;
  const ShapeCore& core_;
  const fcl::Transform3<S> shape_tf_;
};

template <typename Search, typename Placed, typename S>
S distanceBy(const Placed& mesh, const PlacedGeometry<S>& shape, const DistanceQuery<S>& query,
             S enough) {
  if (query.isSatisfied()) return query.result.min_distance;
  visitShape(*shape.geometry, [&](const TriangleShape& geometry, const ShapeCore& core) {
    const Search search(mesh, geometry, core, shape.tf);
    ShapeDistance<S, Search>(shape, search, query, enough).run();
  });
  return query.result.min_distance;
}

template <typename Search, typename Placed, typename S>
std::size_t collideBy(const Placed& mesh, const PlacedGeometry<S>& shape,
                      const CollisionQuery<S>& query) {
  if (query.isSatisfied()) return query.result.numContacts();
  visitShape(*shape.geometry, [&](const TriangleShape& geometry, const ShapeCore& core) {
    const Search search(mesh, geometry, core, shape.tf);
    ShapeContacts<S, Search>(shape, geometry, core, search, query).run();
  });
  return query.result.numContacts();
}

}  // namespace

template <typename S>
S meshShapeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                    const DistanceQuery<S>& query, S enough) {
  return distanceBy<MeshShapeSearch<S>>(mesh, shape, query, enough);
}
template <typename BV>
typename BV::S modelShapeDistance(const PlacedModel<BV>& model,
                                  const PlacedGeometry<typename BV::S>& shape,
                                  const DistanceQuery<typename BV::S>& query) {
  using S = typename BV::S;
  return distanceBy<ModelShapeSearch<BV>>(model, shape, query, S(0));
}

template <typename S>
std::size_t meshShapeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                             const CollisionQuery<S>& query) {
  return collideBy<MeshShapeSearch<S>>(mesh, shape, query);
}
template <typename BV>
std::size_t modelShapeCollide(const PlacedModel<BV>& model,
                              const PlacedGeometry<typename BV::S>& shape,
                              const CollisionQuery<typename BV::S>& query) {
  return collideBy<ModelShapeSearch<BV>>(model, shape, query);
}

template <typename S>
bool isNearer(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2, S distance,
              bool solid) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid) requireClosed(stateOf(mesh), "isNearer of solid bodies");
  const fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result(std::nextafter(distance, std::numeric_limits<S>::infinity()));
  meshShapeDistance<S>(MeshObject<S>(mesh, tf1), {&shape, tf2}, {request, result}, distance);
  return result.o1 != nullptr ||
         (solid && isContained(PlacedGeometry<S>{&shape, tf2}, MeshObject<S>(mesh, tf1)));
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                     \
  template S meshShapeDistance(const MeshObject<S>&, const PlacedGeometry<S>&,          \
                               const DistanceQuery<S>&, S);                             \
  template std::size_t meshShapeCollide(const MeshObject<S>&, const PlacedGeometry<S>&, \
                                        const CollisionQuery<S>&);                      \
  template bool isNearer(const DeformableMesh<S>&, const fcl::Transform3<S>&,           \
                         const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, S, bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE
#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                           \
  template BV::S modelShapeDistance(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&,      \
                                    const DistanceQuery<BV::S>&);                              \
  template std::size_t modelShapeCollide(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&, \
                                         const CollisionQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
