#pragma once

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_shape_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_shape_distance_traversal_node.h>

#include "geometry/rigid.h"
#include "geometry/triangle_shape.h"
#include "query/fcl/recording_node.h"
#include "query/shape_search.h"

namespace adaptive_bvh {

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
  int first = 0;

  void preprocess() override { is_done_ = (*test)(first); }
  bool canStop(typename BV::S bound) const override {
    return is_done_ || FclBoxTraversal<BV>::Distance::canStop(bound);
  }
  void leafTesting(int leaf, int) const override {
    is_done_ = is_done_ || (*test)(this->model1->getBV(leaf).primitiveId());
  }

 private:
  mutable bool is_done_ = false;
};

/// A mesh and a shape in their places. Its searches take the mesh's four-wide tree, or FCL's
/// traversal where it has none or single precision cannot express how the two lie: that then takes
/// the box around the shape. A plane and a half-space have no such box: every triangle is tested.
template <typename BV>
class MeshShapeSearch {
 public:
  using S = typename BV::S;

  MeshShapeSearch(const PlacedMesh<BV>& mesh, const TriangleShape& shape, const ShapeCore& core,
                  const fcl::Transform3<S>& shape_tf)
      : mesh_(mesh),
        shape_(shape),
        core_(core),
        shape_tf_(shape_tf),
        to_shape_(shape_tf, mesh.tf) {}

  /// In the shape's frame.
  TrianglePoints<double> corners(int triangle) const {
    const fcl::Triangle& t = mesh_.model->tri_indices[triangle];
    const fcl::Vector3<S>* vertices = mesh_.model->vertices;
    return {to_shape_(vertices[t[0]]), to_shape_(vertices[t[1]]), to_shape_(vertices[t[2]])};
  }
  TriangleGap gap(int triangle) const { return shape_.gap(corners(triangle)); }
  bool touches(int triangle, ShapeContact& contact) const {
    return shape_.touches(corners(triangle), contact);
  }
  fcl::Vector3<S> inWorld(const fcl::Vector3d& x) const {
    return (shape_tf_.template cast<double>() * x).template cast<S>();
  }
  fcl::Vector3<S> turnedToWorld(const fcl::Vector3d& direction) const {
    return (shape_tf_.linear().template cast<double>() * direction).template cast<S>();
  }

  /// Calls test(triangle) for all that may touch the shape, until it returns true.
  template <typename Test>
  void touching(const Test& test) const {
    const bool is_answered = byBoxes(
        test, [](ShapeSearch<BV>& search, const auto& counted) { search.touching(counted); });
    if (is_answered) return;
    if (!core_.isBounded()) return testAll(test);
    using Node = TouchingNode<BV, Test>;
    RecordingCollisionNode<Node, S> node(statisticsOf(mesh_));
    fcl::CollisionResult<S> unused;
    initialize(static_cast<typename FclBoxTraversal<BV>::Collision&>(node),
               fcl::CollisionRequest<S>(), unused, [&] {
                 node.test = &test;
                 fcl::detail::collide(&node);
               });
  }

  /// Calls test(triangle) for `first` and then for all that may be nearer to the shape than
  /// query.result, the nearest first, until it returns true. The test updates that result.
  template <typename Test>
  void nearest(const DistanceQuery<S>& query, int first, const Test& test) const {
    // As FCL prunes.
    const auto limit = [&]() -> double {
      const S found = query.result.min_distance;
      return std::max(found - query.request.abs_err, found / (1 + query.request.rel_err));
    };
    const bool is_answered = byBoxes(test, [&](ShapeSearch<BV>& search, const auto& counted) {
      if (!counted(first)) search.nearest(limit, counted);
    });
    if (is_answered) return;
    if (!core_.isBounded()) return testAll(test);
    using Node = NearestNode<BV, Test>;
    RecordingDistanceNode<Node, S> node(statisticsOf(mesh_));
    initialize(static_cast<typename FclBoxTraversal<BV>::Distance&>(node), query.request,
               query.result, [&] {
                 node.test = &test;
                 node.first = first;
                 fcl::detail::distance(&node);
               });
  }

 private:
  template <typename Test, typename Run>
  bool byBoxes(const Test& test, const Run& run) const {
    if (!mesh_.hasBoxes()) return false;
    ShapeSearch<BV> search(mesh_, core_, shape_tf_);
    if (!search.isPossible()) return false;
    QueryWork work;
    run(search, [&](int triangle) {
      ++work.leaf_tests;
      return test(triangle);
    });
    work.box_tests = search.boxTests();
    statisticsOf(mesh_).recordQuery(work);
    return true;
  }

  template <typename Test>
  void testAll(const Test& test) const {
    QueryWork work;
    for (int i = 0; i < mesh_.model->num_tris; ++i) {
      ++work.leaf_tests;
      if (test(i)) break;
    }
    statisticsOf(mesh_).recordQuery(work);
  }

  template <typename Node, typename Request, typename Result, typename Run>
  void initialize(Node& node, const Request& request, Result& result, const Run& run) const {
    updateVolumes(mesh_);
    const fcl::Vector3d half = (core_.high - core_.low) / 2 + fcl::Vector3d::Constant(core_.radius);
    const fcl::Box<S> box(fcl::Vector3<S>((2 * half).template cast<S>()));
    fcl::Transform3<S> box_tf = shape_tf_;
    box_tf.translation() = inWorld((core_.low + core_.high) / 2);
    const NoSolver solver;
    fcl::detail::initialize(node, *mesh_.model, mesh_.tf, box, box_tf, &solver, request, result);
    run();
  }

  const PlacedMesh<BV>& mesh_;
  const TriangleShape& shape_;
  const ShapeCore& core_;
  const fcl::Transform3<S> shape_tf_;
  const RelativePlacement to_shape_;
};

}  // namespace adaptive_bvh
