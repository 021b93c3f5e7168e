#include "fcl/model_pairs.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/utility.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_shape_distance_traversal_node.h>

#include "dispatch/shape_triangles.h"
#include "thesis/recording_node.h"
#include "thesis/volumes/volume.h"

// Distance and collision of a model and a shape: FCL's traversal of the model and a box around the
// shape finds triangles, and dispatch/shape_triangles.h tests them, in double precision.
namespace adaptive_bvh {
namespace {

/// FCL's traversals need a solver, but it is not called: the library itself tests triangles.
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
template <>
struct FclBoxTraversal<fcl::RSSd> {
  using Collision = fcl::detail::MeshShapeCollisionTraversalNodeRSS<fcl::Boxd, NoSolver>;
  using Distance = fcl::detail::MeshShapeDistanceTraversalNodeRSS<fcl::Boxd, NoSolver>;
};

template <>
struct FclBoxTraversal<fcl::OBBRSSd> {
  using Collision = fcl::detail::MeshShapeCollisionTraversalNodeOBBRSS<fcl::Boxd, NoSolver>;
  using Distance = fcl::detail::MeshShapeDistanceTraversalNodeOBBRSS<fcl::Boxd, NoSolver>;
};

/// FCL's collision traversal: calls test(triangle) for triangles that it reaches, until it is true.
template <typename BV>
class TouchingNode : public FclBoxTraversal<BV>::Collision {
 public:
  const ShapeSearch::Test* test = nullptr;

  bool canStop() const override { return is_done_; }
  void leafTesting(int leaf, int) const override {
    is_done_ = (*test)(this->model1->getBV(leaf).primitiveId());
  }

 private:
  mutable bool is_done_ = false;
};

/// The same for FCL's distance traversal. Like FCL, tests triangle 0 first, for a first bound.
template <typename BV>
class NearestNode : public FclBoxTraversal<BV>::Distance {
 public:
  const ShapeSearch::Test* test = nullptr;

  void preprocess() override { is_done_ = (*test)(0); }
  bool canStop(double bound) const override {
    return is_done_ || FclBoxTraversal<BV>::Distance::canStop(bound);
  }
  void leafTesting(int leaf, int) const override {
    is_done_ = is_done_ || (*test)(this->model1->getBV(leaf).primitiveId());
  }

 private:
  mutable bool is_done_ = false;
};

/// The search for triangles of a model near a shape: by FCL's traversal of the model and the box
/// around the shape. A plane or half-space has no such box; then every triangle is tested.
template <typename BV>
class ModelShapeSearch final : public ShapeSearch {
 public:
  /// `core` describes the same shape. The search keeps references to `model` and `core`.
  ModelShapeSearch(const PlacedModel<BV>& model, const PlacedSolid& shape, const ShapeCore& core,
                   const fcl::Transform3d& shape_tf)
      : ShapeSearch(model.queryTriangles(), shape),
        model_(model),
        core_(core),
        shape_tf_(shape_tf) {}

  void touching(const Test& test) const override {
    if (!core_.isBounded()) return testAll(test);
    using Node = TouchingNode<BV>;
    RecordingCollisionNode<Node> node(statisticsOf(model_));
    fcl::CollisionResultd unused_result;
    initialize(static_cast<typename FclBoxTraversal<BV>::Collision&>(node),
               fcl::CollisionRequestd(), unused_result);
    node.test = &test;
    fcl::detail::collide(&node);
  }

  void nearest(const DistanceQuery& query, const PointPair&, const Test& test) const override {
    if (!core_.isBounded()) return testAll(test);
    using Node = NearestNode<BV>;
    RecordingDistanceNode<Node> node(statisticsOf(model_));
    fcl::DistanceRequestd request;
    request.rel_err = query.request.rel_err;
    request.abs_err = query.request.abs_err;
    // FCL's traversal stops where volumes are farther than this result.
    fcl::DistanceResultd bound(query.result.min_distance);
    initialize(static_cast<typename FclBoxTraversal<BV>::Distance&>(node), request, bound);
    const Test test_and_lower_bound = [&](int triangle) {
      const bool is_done = test(triangle);
      bound.min_distance = query.result.min_distance;
      return is_done;
    };
    node.test = &test_and_lower_bound;
    fcl::detail::distance(&node);
  }

  /// The box that FCL makes of the root volume, in the world. (FCL centres that of an RSS on the
  /// rectangle's corner. That is kept, so that the approximate cost is FCL's.)
  void boxAround(fcl::Boxd& box, fcl::Transform3d& box_tf) const override {
    fcl::Boxd root;
    fcl::Transform3d root_tf;
    fcl::constructBox(model_.model->getBV(0).bv, model_.tf, root, root_tf);
    box.side = root.side;
    box_tf = root_tf;
  }

 private:
  void testAll(const Test& test) const {
    QueryWork work;
    for (int i = 0; i < model_.numTriangles(); ++i) {
      ++work.leaf_tests;
      if (test(i)) break;
    }
    statisticsOf(model_).recordQuery(work);
  }

  /// Initializes a traversal of the model and the box around the shape: the box of the shape's
  /// core, grown by the core's radius, rounded to S as all of FCL's traversal is. FCL's node keeps
  /// pointers to the box and the solver, which end here: only FCL's own leaf tests and preprocess,
  /// which our nodes override, would use them.
  template <typename Node, typename Request, typename Result>
  void initialize(Node& node, const Request& request, Result& result) const {
    const fcl::Vector3d half = (core_.high - core_.low) / 2 + fcl::Vector3d::Constant(core_.radius);
    const fcl::Boxd box(fcl::Vector3d((2 * half)));
    fcl::Transform3d box_tf = shape_tf_;
    box_tf.translation() = triangles.inWorld((core_.low + core_.high) / 2);
    const NoSolver solver;
    fcl::detail::initialize(node, *model_.model, model_.tf, box, box_tf, &solver, request, result);
  }

  const PlacedModel<BV>& model_;
  const ShapeCore& core_;
  const fcl::Transform3d shape_tf_;
};

/// Calls use(search) with the search of the model and the shape.
template <typename BV, typename Use>
void withSearch(const PlacedModel<BV>& model, const PlacedGeometry& shape, const Use& use) {
  const ShapeSolid solid(*shape.geometry);
  const fcl::Transform3d shape_tf = shape.tf;
  use(ModelShapeSearch<BV>(model, {*solid, shape_tf}, solid.core(), shape.tf));
}

}  // namespace

template <typename BV>
void modelShapeDistance(const PlacedModel<BV>& model, const PlacedGeometry& shape,
                        const DistanceQuery& query) {
  if (query.isSatisfied()) return;
  withSearch(model, shape, [&](const ShapeSearch& search) {
    const double before = query.result.min_distance;
    distanceToShape(search, query);
    setObjects(before, *model.model, *shape.geometry, query);
  });
}

template <typename BV>
void modelShapeCollide(const PlacedModel<BV>& model, const PlacedGeometry& shape,
                       const CollisionQuery& query) {
  if (query.isSatisfied()) return;
  withSearch(model, shape, [&](const ShapeSearch& search) {
    collideWithShape(search, *model.model, *shape.geometry, query);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                              \
  template void modelShapeDistance(const PlacedModel<BV>&, const PlacedGeometry&, \
                                   const DistanceQuery&);                         \
  template void modelShapeCollide(const PlacedModel<BV>&, const PlacedGeometry&,  \
                                  const CollisionQuery&);
ADAPTIVE_BVH_FOR_EACH_DOUBLE_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
