#pragma once

#include <cmath>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/sphere.h>

#include "query/placed_triangle.h"
#include "query/unset_fields.h"

namespace adaptive_bvh {

/// The distance of a shape and a triangle of a mesh by FCL's solvers; -1 when they touch.
template <typename S>
struct ShapeTriangleDistance {
  S distance = -1;
  fcl::Vector3<S> on_shape = unsetPoint<S>(), on_triangle = unsetPoint<S>();  ///< in the world
};

template <typename BV, typename Shape, typename Solver, typename S = typename BV::S>
ShapeTriangleDistance<S> shapeTriangleDistance(const Solver& solver, const Shape& shape,
                                               const fcl::Transform3<S>& shape_tf,
                                               const fcl::BVHModel<BV>& mesh,
                                               const fcl::Transform3<S>& mesh_tf, int triangle) {
  const fcl::Triangle& corners = mesh.tri_indices[triangle];
  ShapeTriangleDistance<S> found;
  if (!solver.shapeTriangleDistance(shape, shape_tf, mesh.vertices[corners[0]],
                                    mesh.vertices[corners[1]], mesh.vertices[corners[2]], mesh_tf,
                                    &found.distance, &found.on_shape, &found.on_triangle))
    return {};
  return found;
}

/// For a sphere FCL's solvers give the points in two frames, and no distance when it touches.
template <typename BV, typename Solver, typename S = typename BV::S>
ShapeTriangleDistance<S> shapeTriangleDistance(const Solver&, const fcl::Sphere<S>& sphere,
                                               const fcl::Transform3<S>& sphere_tf,
                                               const fcl::BVHModel<BV>& mesh,
                                               const fcl::Transform3<S>& mesh_tf, int triangle) {
  const fcl::Vector3<S> center = sphere_tf.translation();
  const fcl::Vector3<S> nearest =
      nearestPoint<S>(triangleInWorld<BV>(mesh, triangle, mesh_tf), center);
  const S to_center = (nearest - center).norm();
  if (!(to_center > sphere.radius)) return {};
  return {to_center - sphere.radius, center + (nearest - center) * (sphere.radius / to_center),
          nearest};
}

}  // namespace adaptive_bvh
